// SPDX-License-Identifier: Apache-2.0
#include "cli/arguments.h"

#include <spdlog/fmt/fmt.h>
#include <CLI/CLI.hpp>

#include <algorithm>
#include <charconv>

#include "cli/checks.h"
#include "ewa/error.h"
#include "train/run_options.h"

namespace ewa::cli {
namespace {

std::vector<std::string> comma_separated(const std::string& text) {
    std::vector<std::string> parts(1);
    for (const char c : text) {
        if (c == ',')
            parts.emplace_back();
        else
            parts.back() += c;
    }
    return parts;
}

template <typename T>
bool parse_number(const std::string& text, T& value) {
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    return error == std::errc() && end == text.data() + text.size();
}

std::vector<int> listed_frames(const Dataset& dataset, const std::string& list) {
    std::vector<int> frames;
    for (const std::string& part : comma_separated(list)) {
        int index = 0;
        if (!parse_number(part, index))
            throw InputError("'" + list + "' is not all, train, test or frame indices such as 0,3,7");
        if (index < 0 || index >= static_cast<int>(dataset.frames.size()))
            throw InputError(
                fmt::format("there is no frame {}: {} has {} frames, numbered from 0 in name order", index,
                            dataset.root.string(), dataset.frames.size()));
        if (std::find(frames.begin(), frames.end(), index) == frames.end()) frames.push_back(index);
    }
    return frames;
}

}  // namespace

RenderOptions DrawArguments::options() const {
    RunOptions drawn;
    const auto set = [&](const char* name, const std::string& text) {
        try {
            train::run_option(name).set(drawn, text);
        } catch (const InputError& error) {
            throw InputError(std::string("--") + name + ": " + error.what());
        }
    };
    if (background == "random") throw InputError("--background: only ewa train takes random");
    set("background", background);
    set("kernel", kernel);
    RenderOptions render = drawn.train.render;
    if (antialias && kernel == "ewa") throw InputError("--antialias and --kernel ewa exclude each other");
    if (antialias) render.kernel = Footprint::antialias;
    render.sh_degree = sh_degree;
    return render;
}

void add_draw_options(CLI::App& app, DrawArguments& arguments) {
    app.add_option("--background", arguments.background, "Background colour: r,g,b in 0..1")
        ->type_name("COLOUR")
        ->capture_default_str();
    const train::RunOption& kernel = train::run_option("kernel");
    app.add_option("--kernel", arguments.kernel, kernel.help)
        ->check(CLI::IsMember(kernel.choices))
        ->capture_default_str();
    app.add_flag("--antialias", arguments.antialias, "The same as --kernel antialias");
    app.add_option("--sh-degree", arguments.sh_degree, "Highest degree of the spherical harmonics")
        ->check(in_range(0, kMaxShDegree))
        ->type_name("0..3")
        ->capture_default_str();
}

CLI::Validator without_sign() {
    return CLI::Validator(
        [](std::string& text) {
            return text.find_first_not_of("0123456789") == std::string::npos
                       ? ""
                       : text + " is not a whole number from 0";
        },
        "");
}

void add_device_options(CLI::App& app, DeviceOptions& options) {
    const train::RunOption& device = train::run_option("device");
    app.add_option("--device", options.selector, device.help)->type_name(device.value);
    app.add_flag("--validation", options.validation, "Enable the Vulkan validation layer")
        ->group("For developers");
}

void add_masks_option(CLI::App& app, MaskUse& masks) {
    const train::RunOption& option = train::run_option("masks");
    app.add_option_function<std::string>(
           "--masks",
           [&option, &masks](const std::string& text) {
               RunOptions run;
               option.set(run, text);
               masks = run.masks;
           },
           option.help)
        ->check(CLI::IsMember(option.choices))
        ->default_str("auto");
}

void add_downscale_option(CLI::App& app, int& downscale) {
    app.add_option("--downscale", downscale, train::run_option("downscale").help)
        ->check(in_range(1, 1024))
        ->type_name("K")
        ->capture_default_str();
}

void add_test_every_option(CLI::App& app, int& test_every) {
    app.add_option("--test-every", test_every, train::run_option("test-every").help)
        ->check(in_range(0, 1000000000))
        ->type_name("K")
        ->capture_default_str();
}

void add_splats(CLI::App& app, std::filesystem::path& splats) {
    app.add_option("SPLATS", splats, "Splat file (.ply .compressed.ply .splat .spz .glb .gltf)")
        ->required()
        ->type_name("");
}

void add_dataset(CLI::App& app, std::filesystem::path& dataset) {
    app.add_option(
           "DATASET", dataset,
           "Images with cameras: a COLMAP folder or transforms.json. Or a glTF file of meshes, which is "
           "rendered as in ewa train")
        ->required()
        ->type_name("");
}

void add_frames_options(CLI::App& app, std::string& frames, int& test_every) {
    app.add_option("--frames", frames, "all, train, test, or indices in name order such as 0,3,7")
        ->type_name("FRAMES")
        ->capture_default_str();
    add_test_every_option(app, test_every);
}

void add_quiet_option(CLI::App& app, bool& quiet) {
    app.add_flag("--quiet", quiet, "Print only errors");
}

std::vector<int> select_frames(const Dataset& dataset, const std::string& which, int test_every) {
    if (dataset.frames.empty()) throw InputError(dataset.root.string() + " has no frames");
    if (which != "all" && which != "train" && which != "test") return listed_frames(dataset, which);

    const Split split = split_frames(dataset, test_every);
    std::vector<int> frames;
    if (which != "test") frames.insert(frames.end(), split.train.begin(), split.train.end());
    if (which != "train") frames.insert(frames.end(), split.test.begin(), split.test.end());
    std::sort(frames.begin(), frames.end());
    if (frames.empty())
        throw InputError(fmt::format("no frame of {} is in the {} split with --test-every {}",
                                     dataset.root.string(), which, test_every));
    return frames;
}

}  // namespace ewa::cli
