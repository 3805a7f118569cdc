// SPDX-License-Identifier: Apache-2.0
#include "scene/looks.h"

#include <array>

#include "core/exclusion.h"
#include "ewa/error.h"
#include "ewa/sky_map.h"
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

using core::Relation;
using Row = core::Exclusion<Look>;

template <Footprint kernel>
bool drawn_with(const Look& look) {
    return look.render.kernel == kernel;
}
template <Integrator integrator>
bool integrated_by(const Look& look) {
    return look.render.integrator == integrator;
}
bool points(const Look& look) {
    return look.render.points;
}

constexpr std::string_view kNoFootprint = "a sphere has no footprint";
constexpr std::array kRows{
    Row{"--points", points, Relation::excludes, "--kernel antialias", drawn_with<Footprint::antialias>,
        kNoFootprint},
    Row{"--points", points, Relation::excludes, "--kernel density", drawn_with<Footprint::density>,
        kNoFootprint},
    Row{"--points", points, Relation::excludes, "--integrator",
        [](const Look& look) { return look.render.integrator != Integrator::splat; },
        "spheres are blended on the image"},
    Row{"--integrator march", integrated_by<Integrator::march>, Relation::excludes, "--kernel antialias",
        drawn_with<Footprint::antialias>, "the others antialias"},
    Row{"--nearest", [](const Look& look) { return look.nearest; }, Relation::needs, "--points", points},
    Row{"--samples", [](const Look& look) { return look.samples; }, Relation::needs, "--integrator march",
        integrated_by<Integrator::march>}};

}  // namespace

void check_look(const Look& look) {
    core::check_exclusions(kRows, look);
}

void check_lens(const RenderOptions& render, const Camera& camera) {
    check(render);
    if (camera.distortion.none() && !moves(camera)) return;
    const std::string_view option = render.points                            ? "--points"
                                    : render.integrator != Integrator::splat ? "--integrator"
                                                                             : "";
    if (moves(camera) && (!option.empty() || render.sky))
        throw InputError(std::string(option.empty() ? "--background sky" : option) +
                         " draws no images of a rolling shutter");
    const bool shot = render.integrator != Integrator::splat && camera.distortion.lens != Lens::orthographic;
    if (option == "--integrator" && !shot)
        throw InputError(
            "--integrator splat alone draws parallel rays; the others need a lens with a centre");
    if (!option.empty() && !shot)
        throw InputError(std::string(option) +
                         " draws through pinholes only; take --lens undistort for images of another lens");
}

}  // namespace scene
}  // namespace ewa
