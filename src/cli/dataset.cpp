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
    options::add(app, "SCENE", arguments->scene);
    options::add(app, "output", arguments->output);
    options::add(app, "views", arguments->views);
    options::add(app, "size", arguments->size);
    options::add(app, "samples", options.samples);
    options::add(app, "points", options.points);
    options::add(app, "exposure", arguments->exposure);
    options::add(app, "vary-appearance", arguments->varied);
    options::add(app, "through", arguments->lens);
    options::add(app, "rolling-shutter", arguments->shutter);
    options::add(app, "sky", options.sky);
    options::add(app, "seed", options.seed);
    options::add(app, "force", options.force);
    add_device_options(app, arguments->device);
    options::add(app, "quiet", arguments->quiet);
    return [arguments] { return run(*arguments); };
}

}  // namespace ewa::cli
