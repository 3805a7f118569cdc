// SPDX-License-Identifier: Apache-2.0
// ewa dataset: renders a mesh scene into a dataset.
#include <spdlog/fmt/fmt.h>
#include <CLI/CLI.hpp>

#include <memory>
#include <string>
#include <vector>

#include "cli/arguments.h"
#include "cli/command.h"
#include "cli/lens_argument.h"
#include "core/text.h"
#include "ewa/error.h"
#include "io/datasets/dataset_folders.h"
#include "scene/readout.h"

namespace ewa::cli {
namespace {

namespace fs = std::filesystem;

struct DatasetArguments {
    fs::path scene, output;
    std::string size, exposure = "auto", lens, shutter;
    int views = -1;
    SyntheticOptions options;
    DeviceOptions device;
    bool varied = false, quiet = false;
};

/// From DIRECTION:DEGREES[,PERCENT].
RollingShutter shutter_of(const std::string& text) {
    const auto fail = [&](const std::string& what) {
        return InputError("--rolling-shutter: " + what +
                          "; expected DIRECTION:DEGREES[,PERCENT], as in top-to-bottom:3,2");
    };
    const size_t colon = text.find(':');
    const auto from = core::find_value(scene::kReadoutWords, text.substr(0, colon));
    if (!from)
        throw fail("'" + text.substr(0, colon) +
                   "' is not top-to-bottom, bottom-to-top, left-to-right or right-to-left");
    const std::string numbers = colon == std::string::npos ? "" : text.substr(colon + 1);
    std::vector<double> values = core::parse_list(numbers).value_or(std::vector<double>());
    if (values.empty() || values.size() > 2)
        throw fail("'" + numbers + "' is not a number, or two with a comma");
    values.resize(2);
    return {*from, values[0], values[1]};
}

int run(const DatasetArguments& arguments) {
    io::check_not_inside_dataset("-o", arguments.output);
    SyntheticOptions options = arguments.options;
    if (arguments.views >= 0) options.views = arguments.views;
    if (!arguments.lens.empty()) {
        const LensArgument lens = lens_of(arguments.lens);
        options.lens = lens.lens;
        options.fisheye_degrees = lens.fisheye_degrees;
    }
    const bool around = options.lens.lens == Lens::equirectangular;
    const core::PixelSize size = size_of(!arguments.size.empty() ? arguments.size
                                         : around                ? "256x128"
                                                                 : "256x256");
    options.width = size.width;
    options.height = size.height;
    if (!arguments.shutter.empty()) options.rolling_shutter = shutter_of(arguments.shutter);
    if (arguments.varied) options.appearance = AppearanceModel::ppisp;
    if (arguments.exposure != "auto") {
        options.exposure = core::parse_number(arguments.exposure);
        if (!options.exposure)
            throw InputError("--exposure: '" + arguments.exposure +
                             "' is neither auto nor a number of stops");
    }
    render_with_progress(arguments.device, arguments.scene, arguments.output, options, arguments.quiet);
    return 0;
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
        ->transform(in_range(0, 100000))
        ->type_name("N");
    app.add_option("--size", arguments->size,
                   "Width and height in pixels [256x256, for equirectangular 256x128]")
        ->type_name("WxH");
    app.add_option("--samples", options.samples, "Paths per pixel")
        ->transform(in_range(1, 65536))
        ->type_name("N")
        ->capture_default_str();
    app.add_option("--points", options.points, "Points on the surfaces, for initial splats; 0: none")
        ->transform(in_range(0, 10000000))
        ->type_name("N")
        ->capture_default_str();
    app.add_option("--exposure", arguments->exposure, "Exposure in stops, or auto")
        ->type_name("EV")
        ->capture_default_str();
    app.add_flag(
        "--vary-appearance", arguments->varied,
        "Give each image an exposure and colours of its own, and the camera a vignette and a response. "
        "DIR/appearance.json has them");
    app.add_option("--through", arguments->lens,
                   std::string("The lens of all cameras, in place of a pinhole: ") + kLensForms)
        ->type_name("LENS");
    app.add_option("--rolling-shutter", arguments->shutter,
                   "A rolling shutter of all cameras, as DIRECTION:DEGREES[,PERCENT]. The directions are "
                   "top-to-bottom, "
                   "bottom-to-top, left-to-right and right-to-left. During the readout each camera turns by "
                   "DEGREES and moves by PERCENT of its distance to the scene, in directions of its own")
        ->type_name("SHUTTER");
    app.add_flag("--sky", options.sky, "Show the sky in the images, which else are transparent there");
    app.add_option("--seed", options.seed,
                   "Seed of random numbers. The same seed on the same device gives the same bytes")
        ->check(accepted_by(train::run_option("seed")))
        ->type_name("S")
        ->capture_default_str();
    app.add_flag("--force", options.force, "Replace DIR's views of another scene or of other options");
    add_device_options(app, arguments->device);
    add_quiet_option(app, arguments->quiet);
    return [arguments] { return run(*arguments); };
}

}  // namespace ewa::cli
