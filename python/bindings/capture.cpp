// SPDX-License-Identifier: Apache-2.0
#include "ewa/capture.h"

#include <nanobind/nanobind.h>
#include <nanobind/stl/string.h>

#include <exception>
#include <string>
#include <vector>

#include "bindings.h"
#include "core/text.h"
#include "core/typing.h"
#include "core/words.h"
#include "device.h"
#include "errors.h"
#include "ewa/error.h"
#include "inputs.h"
#include "options.h"

namespace ewa::python {
namespace {

namespace fs = std::filesystem;

const core::Words<Matching> kMatchings{
    {"auto", Matching::automatic}, {"sequence", Matching::sequence}, {"unordered", Matching::unordered}};

/// Gives the callback each change. What it raises, and signals, end the search.
class Watch {
  public:
    explicit Watch(nb::handle callback) : callback_(callback) {}
    bool operator()(const CaptureProgress& now) {
        const nb::gil_scoped_acquire interpreter;
        try {
            check_signals();
            if (!now.note.empty()) notes_.push_back(now.note);
            const auto state = std::tuple(now.what, now.done, now.total);
            if (!callback_.is_none() && now.total > 0 && std::exchange(last_, state) != state)
                callback_(now.what + " " + now.unit, now.done, now.total);
            return true;
        } catch (...) {
            raised_ = std::current_exception();
            return false;
        }
    }
    void check() const {
        if (raised_) std::rethrow_exception(raised_);
    }
    const std::vector<std::string>& notes() const { return notes_; }

  private:
    nb::handle callback_;
    std::tuple<std::string, int, int> last_;
    std::vector<std::string> notes_;
    std::exception_ptr raised_;
};

/// The Python that runs this. Its environment may have pycolmap, and is not always in PATH.
fs::path python_program() {
    const nb::object program = nb::module_::import_("sys").attr("executable");
    return nb::isinstance<nb::str>(program) ? nb::cast<std::string>(program) : std::string();
}

LoadedDataset find_cameras(const fs::path& photos, const fs::path& output, int frames,
                           const std::string& matching, bool level, nb::handle progress) {
    if (frames < kFewestVideoFrames || frames > kMostVideoFrames)
        throw InputError("frames is not from " + std::to_string(kFewestVideoFrames) + " to " +
                         std::to_string(kMostVideoFrames));
    const CaptureOptions options{
        .frames = frames,
        .matching = of_argument("matching", [&] { return core::value_of(kMatchings, matching); }),
        .level = level,
        .python = python_program()};
    Watch watch(progress);
    Capture capture;
    {
        const nb::gil_scoped_release released;
        capture =
            make_dataset(photos, output, options, [&](const CaptureProgress& now) { return watch(now); });
    }
    watch.check();
    for (const std::string& note : watch.notes()) warn(PyExc_UserWarning, spelled(note.c_str()));
    for (const std::string& remark : capture.remarks) warn(PyExc_UserWarning, spelled(remark.c_str()));
    return open_dataset(output);
}

}  // namespace

void bind_capture(nb::module_& module) {
    module.def(
        "find_cameras", find_cameras, nb::arg("photos"), nb::arg("output"), nb::kw_only(),
        nb::arg("frames") = CaptureOptions().frames, nb::arg("matching") = "auto", nb::arg("level") = true,
        nb::arg("progress") = nb::none(),
        nb::sig("def find_cameras(photos: str | os.PathLike[str], output: str | os.PathLike[str], *, frames: "
                "int = 300, matching: typing.Literal['auto', 'sequence', 'unordered'] = 'auto', level: bool "
                "= True, progress: "
                "collections.abc.Callable[[str, int, int], object] | None = None) -> Dataset"),
        "Finds the cameras of a folder of photos, a zip archive of them or a video by COLMAP and ffmpeg, "
        "which must be installed; the package pycolmap does for COLMAP. The dataset is written to the folder "
        "output, where an interrupted search "
        "continues. frames: of a video. level: false "
        "keeps COLMAP's axes. progress: called with what is done, how many and of how many. Photos "
        "that cannot be placed are warnings. Ctrl-C ends it. Raises InputError, or DeviceError where a "
        "program is missing or fails.");
}

}  // namespace ewa::python
