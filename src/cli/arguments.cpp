// SPDX-License-Identifier: Apache-2.0
#include "cli/arguments.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <charconv>
#include <map>

#include "ewa/error.h"

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

std::array<float, 3> parse_background(const std::string& text) {
    const auto parts = comma_separated(text);
    std::array<float, 3> color{};
    bool good = parts.size() == 3;
    for (size_t i = 0; good && i < 3; ++i)
        good = parse_number(parts[i], color[i]) && color[i] >= 0 && color[i] <= 1;
    if (!good) throw InputError("--background: '" + text + "' is not r,g,b with each in 0..1, such as 1,1,1");
    return color;
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
    RenderOptions render;
    if (!random_background()) render.background = parse_background(background);
    if (antialias && kernel == "ewa") throw InputError("--antialias and --kernel ewa exclude each other");
    render.kernel = antialias || kernel == "antialias" ? Footprint::antialias
                    : kernel == "ewa"                  ? Footprint::unit_mass
                                                       : Footprint::peak;
    render.sh_degree = sh_degree;
    return render;
}

void add_draw_options(CLI::App& app, DrawArguments& arguments) {
    app.add_option("--background", arguments.background,
                   arguments.random_allowed
                       ? "Colour behind the splats: r,g,b in 0..1, or random (a new one each step)"
                       : "Colour behind the splats: r,g,b in 0..1")
        ->type_name("COLOUR")
        ->capture_default_str();
    app.add_option("--kernel", arguments.kernel,
                   "Footprint: peak (3DGS), antialias (Mip-Splatting), ewa (unit mass)")
        ->check(CLI::IsMember({"peak", "antialias", "ewa"}))
        ->capture_default_str();
    app.add_flag("--antialias", arguments.antialias, "The same as --kernel antialias");
    if (!arguments.degree_by_dataset) {
        app.add_option("--sh-degree", arguments.sh_degree, "Highest degree of view-dependent colour")
            ->check(in_range(0, kMaxShDegree))
            ->type_name("0..3")
            ->capture_default_str();
        return;
    }
    arguments.sh_degree = -1;
    app.add_option("--sh-degree", arguments.sh_degree,
                   "Highest degree of view-dependent colour; auto: 3, or 0 where the dataset says that no "
                   "colour depends on "
                   "the view")
        ->transform(CLI::Validator(
            [](std::string& text) {
                if (text != "auto") return CLI::Range(0, kMaxShDegree)(text);
                text = "-1";
                return std::string();
            },
            ""))
        ->type_name("auto|0..3")
        ->default_str("auto");
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
    app.add_option("--device", options.selector, "Number or part of the name of a device (see ewa devices)")
        ->type_name("NAME|N");
    app.add_flag("--validation", options.validation, "Turn the Vulkan validation layer on")
        ->group("For developers");
}

namespace {
const std::map<std::string, MaskUse> kMaskUses = {{"auto", MaskUse::automatic},
                                                  {"ignore", MaskUse::ignore},
                                                  {"cut", MaskUse::cut},
                                                  {"none", MaskUse::none}};
}

void add_masks_option(CLI::App& app, MaskUse& masks) {
    app.add_option(
           "--masks", masks,
           "What masks/ and alpha are for: ignore (pixels do not count), cut (out of the background), none, "
           "or auto: ignore where there are mask files, else cut")
        ->transform(CLI::CheckedTransformer(kMaskUses).description(""))
        ->type_name("USE")
        ->default_str(masks_text(masks));
}

std::string masks_text(MaskUse masks) {
    for (const auto& [name, use] : kMaskUses)
        if (use == masks) return name;
    return {};
}

void add_downscale_option(CLI::App& app, int& downscale) {
    app.add_option("--downscale", downscale, "Divide the pictures' width and height by this")
        ->check(in_range(1, 1024))
        ->type_name("K")
        ->capture_default_str();
}

void add_test_every_option(CLI::App& app, int& test_every) {
    app.add_option("--test-every", test_every, "Every K-th picture in name order is held out; 0: none")
        ->check(in_range(0, 1000000000))
        ->type_name("K")
        ->capture_default_str();
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
