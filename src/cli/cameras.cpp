// SPDX-License-Identifier: Apache-2.0
// ewa cameras: finds the cameras of photos or of a video's frames.
#include "cli/cameras.h"

#include <spdlog/fmt/fmt.h>
#include <CLI/CLI.hpp>

#include <memory>

#include "cli/arguments.h"
#include "cli/command.h"
#include "cli/interrupt.h"
#include "cli/output.h"
#include "core/text.h"
#include "core/words.h"
#include "ewa/error.h"

namespace ewa::cli {
namespace {

namespace fs = std::filesystem;

struct CamerasArguments {
    fs::path input, output;
    CaptureOptions options;
    std::string matching = "auto";
    RunOptions run;  // of which it has the level
    bool quiet = false;
};

const core::Words<Matching> kMatchings = {
    {"auto", Matching::automatic}, {"sequence", Matching::sequence}, {"unordered", Matching::unordered}};

int run(const CLI::App& app, CamerasArguments& arguments) {
    arguments.options.matching = core::value_of(kMatchings, arguments.matching);
    arguments.options.level = arguments.run.level;
    if (app.count("--frames") > 0 && !has_videos(arguments.input) &&
        (fs::is_directory(arguments.input) || is_archive(arguments.input)))
        refuse_frames(std::to_string(arguments.options.frames), arguments.input);
    Progress progress("searched", 1, "photos", arguments.quiet);
    place_with_progress(arguments.input, arguments.output, arguments.options, progress);
    return 0;
}

}  // namespace

void refuse_frames(const std::string& frames, const fs::path& photos) {
    throw InputError("--frames " + frames + ": " + core::one_line(photos.string()) +
                     " has photos, of which all are used; --frames is for datasets and videos");
}

void place_with_progress(const fs::path& input, const fs::path& folder, const CaptureOptions& options,
                         Progress& progress, const CaptureProgressLine::After& after,
                         const CaptureProgressLine::Before& before) {
    const InterruptWatch watch;
    CaptureProgressLine line(progress, after, before);
    const Capture capture = make_dataset(input, folder, options, [&](const CaptureProgress& now) {
        line.update(now);
        return !interrupted();
    });
    if (capture.interrupted) {
        progress.note(kHowToContinue);
        throw Interrupted();
    }
    for (const std::string& remark : capture.remarks) progress.note(remark);
    if (!capture.axes.empty()) progress.note(capture.axes);
    progress.note(
        fmt::format("{}: {} of {} photos have cameras", folder.string(), capture.placed, capture.images));
}

Action add_cameras(CLI::App& app) {
    const auto arguments = std::make_shared<CamerasArguments>();
    options::add(app, "INPUT", arguments->input);
    options::add(app, "output", arguments->output);
    options::add(app, "frames", arguments->options.frames);
    options::add(app, "matching", arguments->matching);
    options::add(app, "level", arguments->run);
    options::add(app, "quiet", arguments->quiet);
    return [&app, arguments] { return run(app, *arguments); };
}

}  // namespace ewa::cli
