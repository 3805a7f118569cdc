// SPDX-License-Identifier: Apache-2.0
// ewa dataset: photographs of a mesh scene.
#include <spdlog/fmt/fmt.h>
#include <CLI/CLI.hpp>

#include <charconv>
#include <memory>

#include "cli/arguments.h"
#include "cli/checks.h"
#include "cli/command.h"
#include "cli/interrupt.h"
#include "cli/progress.h"
#include "cli/synthetic_dataset.h"
#include "core/text.h"
#include "ewa/error.h"

namespace ewa::cli {
namespace {

namespace fs = std::filesystem;

struct DatasetArguments {
    fs::path scene, output;
    std::string size = "256x256", exposure = "auto";
    int views = -1;
    SyntheticOptions options;
    DeviceOptions device;
    bool quiet = false;
};

void parse_size(const std::string& text, SyntheticOptions& options) {
    const char* const end = text.data() + text.size();
    const auto [cross, error] = std::from_chars(text.data(), end, options.width);
    bool good = error == std::errc() && cross != end && *cross == 'x';
    if (good) {
        const auto [last, second] = std::from_chars(cross + 1, end, options.height);
        good = second == std::errc() && last == end;
    }
    if (!good || options.width < 1 || options.height < 1)
        throw InputError("--size: '" + text + "' is not WxH in pixels, such as 256x256");
}

int run(const DatasetArguments& arguments) {
    SyntheticOptions options = arguments.options;
    parse_size(arguments.size, options);
    if (arguments.views >= 0) options.views = arguments.views;
    if (arguments.exposure != "auto") {
        options.exposure = core::parse_number(arguments.exposure);
        if (!options.exposure)
            throw InputError("--exposure: '" + arguments.exposure +
                             "' is neither auto nor a number of stops");
    }
    const SyntheticDataset made = photograph_with_progress(arguments.device, arguments.scene,
                                                           arguments.output, options, arguments.quiet);
    return made.interrupted ? kInterruptedStatus : 0;
}

}  // namespace

SyntheticDataset photograph_with_progress(const DeviceOptions& device, const fs::path& scene,
                                          const fs::path& folder, const SyntheticOptions& options,
                                          bool quiet) {
    const InterruptWatch watch;
    std::unique_ptr<Progress> progress;
    const SyntheticDataset made =
        render_dataset(open_device(device), scene, folder, options, [&](int done, int total) {
            if (!progress) progress = std::make_unique<Progress>("photographed", total, "views", quiet);
            if (done > 0) progress->update(done);
            return !interrupted();
        });
    progress.reset();
    if (quiet) return made;
    for (const std::string& remark : made.remarks) fmt::print("note: {}\n", core::one_line(remark));
    if (made.dropped_triangles > 0)
        fmt::print("{} triangles have a corner that is not finite and are left out\n",
                   made.dropped_triangles);
    if (made.unfinished_rays > 0)
        fmt::print("{} rays took more steps than one invocation may and see nothing\n", made.unfinished_rays);
    if (made.dropped_samples > 0)
        fmt::print("{} paths were not finite and count as black\n", made.dropped_samples);
    if (made.interrupted)
        fmt::print("interrupted; the same command goes on\n");
    else
        fmt::print("{} views are in {}{}, exposure {:+.1f} stops; {}\n", made.views,
                   core::one_line(folder.string()),
                   made.kept > 0 ? fmt::format(" ({} were there already)", made.kept) : "", made.exposure,
                   made.color_depends_on_view ? "colours depend on the view"
                                              : "every material is diffuse: SH degree 0 suffices");
    return made;
}

Action add_dataset(CLI::App& app) {
    const auto arguments = std::make_shared<DatasetArguments>();
    SyntheticOptions& options = arguments->options;
    app.add_option("SCENE", arguments->scene, "A glTF with meshes (.gltf .glb)")->required()->type_name("");
    app.add_option("-o,--output", arguments->output,
                   "Folder for images/, depth/, points.ply and transforms.json. A run that was interrupted "
                   "continues there")
        ->required()
        ->type_name("DIR");
    app.add_option("--views", arguments->views,
                   "Number of cameras on a dome over the scene; 0: the cameras of the file [those of the "
                   "file if there are 8 or more, else 48]")
        ->check(in_range(0, 100000))
        ->type_name("N");
    app.add_option("--size", arguments->size, "Width and height in pixels")
        ->type_name("WxH")
        ->capture_default_str();
    app.add_option("--samples", options.samples, "Paths for each pixel")
        ->check(in_range(1, 65536))
        ->type_name("N")
        ->capture_default_str();
    app.add_option("--points", options.points, "Points on the surfaces, from which training starts; 0: none")
        ->check(in_range(0, 10000000))
        ->type_name("N")
        ->capture_default_str();
    app.add_option("--exposure", arguments->exposure, "Stops between radiance and white, or auto")
        ->type_name("EV")
        ->capture_default_str();
    app.add_option("--seed", options.seed, "Same seed, same device: same bytes")
        ->check(without_sign())
        ->type_name("S")
        ->capture_default_str();
    add_device_options(app, arguments->device);
    app.add_flag("--quiet", arguments->quiet, "Print nothing but errors");
    return [arguments] { return run(*arguments); };
}

}  // namespace ewa::cli
