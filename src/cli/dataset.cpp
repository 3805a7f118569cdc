// SPDX-License-Identifier: Apache-2.0
// ewa dataset: renders a mesh scene into a dataset.
#include <spdlog/fmt/fmt.h>
#include <CLI/CLI.hpp>

#include <charconv>
#include <memory>

#include "cli/arguments.h"
#include "cli/checks.h"
#include "cli/command.h"
#include "cli/dataset_argument.h"
#include "cli/interrupt.h"
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
    const SyntheticDataset made =
        render_with_progress(arguments.device, arguments.scene, arguments.output, options, arguments.quiet);
    return made.interrupted ? kInterruptedStatus : 0;
}

}  // namespace

Action add_dataset(CLI::App& app) {
    const auto arguments = std::make_shared<DatasetArguments>();
    SyntheticOptions& options = arguments->options;
    app.add_option("SCENE", arguments->scene, "glTF file with meshes (.gltf .glb)")
        ->required()
        ->type_name("");
    app.add_option(
           "-o,--output", arguments->output,
           "Folder for images/, depth/, points.ply and transforms.json. An interrupted run continues there")
        ->required()
        ->type_name("DIR");
    app.add_option("--views", arguments->views,
                   "Number of cameras on a dome over the scene; 0: the cameras of the file "
                   "[those of the file if it has 8 or more, else 48]")
        ->check(in_range(0, 100000))
        ->type_name("N");
    app.add_option("--size", arguments->size, "Width and height in pixels")
        ->type_name("WxH")
        ->capture_default_str();
    app.add_option("--samples", options.samples, "Paths per pixel")
        ->check(in_range(1, 65536))
        ->type_name("N")
        ->capture_default_str();
    app.add_option("--points", options.points, "Points on the surfaces, for initial splats; 0: none")
        ->check(in_range(0, 10000000))
        ->type_name("N")
        ->capture_default_str();
    app.add_option("--exposure", arguments->exposure, "Exposure in stops, or auto")
        ->type_name("EV")
        ->capture_default_str();
    app.add_option("--seed", options.seed,
                   "Seed of random numbers. The same seed on the same device gives the same bytes")
        ->check(without_sign())
        ->type_name("S")
        ->capture_default_str();
    add_device_options(app, arguments->device);
    add_quiet_option(app, arguments->quiet);
    return [arguments] { return run(*arguments); };
}

}  // namespace ewa::cli
