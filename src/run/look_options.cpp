// SPDX-License-Identifier: Apache-2.0
#include "run/look_options.h"

#include <spdlog/fmt/fmt.h>

#include <array>
#include <optional>
#include <string>

#include "core/typing.h"
#include "ewa/error.h"
#include "run/option_rows.h"
#include "scene/looks.h"
#include "scene/methods.h"

namespace ewa::train {

RunOption points_option() {
    RunOption option =
        flag("points",
             "Splats are spheres, as PyTorch3D draws points: a pixel blends the nearest ones that "
             "cover it. Opacities and rotations are not used",
             [](RunOptions& o) -> bool& { return o.train.render.points; });
    option.before = "false";
    return option;
}

RunOption nearest_option() {
    RunOption option = number<int>(
        "nearest", "K", "With --points: spheres that a pixel blends", kDecides,
        [](RunOptions& o) -> int& { return o.train.render.nearest; }, 1, kMostNearest);
    option.before = std::to_string(8);
    return option;
}

RunOption background_option() {
    RunOption option{
        "background", "COLOUR",
        "Colour behind the splats: r,g,b in 0..1, a name such as white, #rrggbb, random (a new one each "
        "step), or sky (light from far away that is learned, by direction). auto: photos without "
        "transparency have their mean colour, and each step one near it; others have black",
        kDecides};
    option.get = [](const RunOptions& options) {
        const auto& [r, g, b] = options.train.render.background;
        if (options.train.sky) return std::string("sky");
        if (options.automatic_background && !options.train.random_background) return std::string("auto");
        return options.train.random_background ? "random" : fmt::format("{},{},{}", r, g, b);
    };
    option.set = [](RunOptions& options, const std::string& text) {
        const bool random = text == "random", sky = text == "sky", automatic = text == "auto";
        const auto colour =
            random || sky || automatic ? std::optional(std::array<float, 3>{}) : core::parse_colour(text);
        if (!colour) throw InputError(core::not_a_colour(text));
        options.train.random_background = random;
        options.train.sky = sky;
        options.automatic_background = automatic;
        options.train.render.background = *colour;
    };
    return option;
}

RunOption integrator_option() {
    static const core::Words<Integrator> trained = [] {
        core::Words<Integrator> words = scene::kIntegratorWords;
        std::erase_if(words, [](const auto& word) {
            return bool(scene::method_of({.integrator = word.second}).no_training);
        });
        return words;
    }();
    RunOption option = choice<Integrator>(
        "integrator",
        "How a pixel sees the splats. splat: as footprints on the image. fast-ray: each along the "
        "pixel's own ray, through any lens but parallel rays. ray: the same, in the order on that ray",
        [](RunOptions& o) -> Integrator& { return o.train.render.integrator; }, trained);
    option.before = "splat";
    return option;
}

}  // namespace ewa::train
