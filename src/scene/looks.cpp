// SPDX-License-Identifier: Apache-2.0
#include "scene/looks.h"

#include <array>

#include "ewa/error.h"
#include "ewa/sky_map.h"
#include "scene/methods.h"
#include "scene/readout.h"

namespace ewa {

void check(const RenderOptions& options) {
    if (options.sh_degree < 0)
        throw InputError("the SH degree of a render is " + std::to_string(options.sh_degree) +
                         "; it can be 0 or more");
    if (options.samples < 1 || options.samples > kMostSamples)
        throw InputError(std::to_string(options.samples) + " samples of a ray; it can have 1 to " +
                         std::to_string(kMostSamples));
    if (options.nearest < 1 || options.nearest > kMostNearest)
        throw InputError(std::to_string(options.nearest) + " spheres at a pixel; it can have 1 to " +
                         std::to_string(kMostNearest));
    if (options.sky) check(*options.sky);
}

namespace scene {
namespace {

template <Footprint kernel>
bool drawn_with(const Look& look) {
    return look.render.kernel == kernel;
}

constexpr std::array kKernels{
    Demand<Look>{"--kernel antialias", drawn_with<Footprint::antialias>, &Method::no_antialias},
    Demand<Look>{"--kernel density", drawn_with<Footprint::density>, &Method::no_density}};

}  // namespace

void check_look(const Look& look) {
    const Method& method = method_of(look.render);
    check_demands(kKernels, look, method);
    const auto belongs = [&](bool given, std::string_view option, MethodKind to) {
        if (given && method.kind != to)
            throw InputError(std::string(option).append(" is an option of ").append(method_of(to).full));
    };
    belongs(look.nearest, "--nearest", MethodKind::points);
    belongs(look.samples, "--samples", MethodKind::march);
}

void check_lens(const RenderOptions& render, const Camera& camera) {
    check(render);
    const Method& method = method_of(render);
    const auto need = [&](const Lack& lack) {
        if (lack) throw InputError(std::string(method.option).append(" ").append(lack.why));
    };
    if (moves(camera)) {
        need(method.no_rolling_shutter);
        if (render.sky) throw InputError("--background sky draws no images of a rolling shutter");
    }
    if (camera.distortion.lens == Lens::orthographic) return need(method.no_parallel_rays);
    if (!camera.distortion.none()) need(method.no_lens);
}

}  // namespace scene
}  // namespace ewa
