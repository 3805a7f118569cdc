// SPDX-License-Identifier: Apache-2.0
#include "scene/methods.h"

#include <array>

#include "core/exclusion.h"
#include "ewa/error.h"

namespace ewa::scene {
namespace {

constexpr Lack kNoFootprint{"a sphere has no footprint"}, kNoShutter{"draws no images of a rolling shutter"},
    kPinholes{"draws through pinholes only; take --lens undistort for images of another lens"},
    kNoTransmittance{"rays have no gradient by the transmittance"};

constexpr Method along_rays(MethodKind kind, std::string_view full, std::string_view subject) {
    return {.kind = kind,
            .option = "--integrator",
            .full = full,
            .subject = subject,
            .rays = true,
            .no_footprint = {"rays meet the splats themselves"},
            .no_counts = {"draws neither counts nor ellipsoids; splat does"},
            .no_scale = {"draws splats at their own scale; splat draws others"},
            .no_surface = {"only the integrator splat draws {}"},
            .no_parallel_rays = {"splat alone draws parallel rays; the others need a lens with a centre"},
            .no_rolling_shutter = kNoShutter,
            .no_division = {"how rays meet a splat is gathered within the one picture that shows it"},
            .no_weight = {"rays count no weights at a pixel"},
            .no_camera_gradient = {"rays have no gradient by the camera"},
            .no_depth_gradient = {"depths along rays have no gradient"},
            .no_alpha_gradient = kNoTransmittance,
            .no_sky_gradient = kNoTransmittance,
            .no_pixel_gradient = {"rays have no gradient of single pixels"}};
}

constexpr Method march() {
    Method method = along_rays(MethodKind::march, "--integrator march", "the integrator march");
    method.no_antialias = {"the others antialias", true};
    method.no_depth = {"draws no depth; the others do", true};
    method.no_training = {"cannot train; the others do", true};
    return method;
}

/// In the order of MethodKind.
static_assert(MethodKind(Integrator::ray) == MethodKind::ray &&
              MethodKind(Integrator::march) == MethodKind::march &&
              MethodKind(Integrator::fast_ray) == MethodKind::fast_ray);
constexpr std::array kMethods{
    Method{}, along_rays(MethodKind::ray, "--integrator ray", "the integrator ray"), march(),
    along_rays(MethodKind::fast_ray, "--integrator fast-ray", "the integrator fast-ray"),
    Method{.kind = MethodKind::points,
           .option = "--points",
           .full = "--points",
           .subject = "--points",
           .grow_threshold = 8,  // edges of opaque spheres have larger gradients than soft footprints
           .no_opacity = {"a sphere has no opacity"},
           .no_footprint = kNoFootprint,
           .no_antialias = kNoFootprint,
           .no_density = kNoFootprint,
           .no_surface = {"--points draws no surface, so {} cannot be drawn"},
           .no_lens = kPinholes,
           .no_parallel_rays = kPinholes,
           .no_rolling_shutter = kNoShutter,
           .no_division = {"spheres are listed and moved within the one picture that shows them"},
           .no_trainer_image = {"a trainer of points does not draw pictures: a Renderer of its splats does"},
           .no_relocation = {"it moves splats of low opacity, and a sphere has none"},
           .no_faintness = {"spheres show no passer-by faintly"},
           .no_weight = {"a sphere has no weight at a pixel"},
           .no_camera_gradient = {"spheres have no gradient by the camera"},
           .no_depth_gradient = {"the depth of a sphere has no gradient"},
           .no_alpha_gradient = {"spheres have no gradient by the transmittance"}}};

}  // namespace

const Method& method_of(MethodKind kind) {
    return kMethods[size_t(kind)];
}

const Method& method_of(const RenderOptions& render) {
    const Method &method = kMethods[size_t(render.integrator)], &spheres = method_of(MethodKind::points);
    if (!render.points) return method;
    if (method.rays)
        throw InputError(core::excluded(spheres.option, method.option, "spheres are blended on the image"));
    return spheres;
}

void refuse(const Method& method, const Lack& lack, std::string_view option, bool leads) {
    if (!lack) return;
    const std::string_view name = lack.alone ? method.full : method.option;
    throw InputError(leads ? core::excluded(option, name, lack.why) : core::excluded(name, option, lack.why));
}

}  // namespace ewa::scene
