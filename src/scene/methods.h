// SPDX-License-Identifier: Apache-2.0
// The methods of drawing splats, and the abilities that each method lacks. Other code asks whether a method lacks an ability. Only
// this table, the passes in src/pipeline/methods.cpp, and the options that select a method know it by name.
#pragma once
#include <cstdint>
#include <string_view>

#include "ewa/render_options.h"

namespace ewa::scene {

/// The first values are those of Integrator, in the same order.
enum class MethodKind : uint8_t { splat, ray, march, fast_ray, points };

/// An ability that a method lacks, with the reason. False if the method has the ability.
struct Lack {
    std::string_view why = {};  // the reason, as errors print it
    bool alone = false;         // other methods of the same option have the ability
    explicit constexpr operator bool() const { return !why.empty(); }
};

struct Method {
    MethodKind kind = MethodKind::splat;
    std::string_view option = {};  // that selects the method, as errors write it; the default method has none
    std::string_view full = {};    // the option with its value
    std::string_view subject = {};  // name of the method as the subject of a sentence
    bool rays = false;              // frames have a buffer with each splat's geometry for rays
    float grow_threshold = 1;       // factor of the gradient that adds splats

    // Splats: an opacity with an edge that fades, the linearised projection as footprint, the kernels antialias and density.
    Lack no_opacity{}, no_footprint{}, no_antialias{}, no_density{};
    // Images: counts and ellipsoids, depths, DrawOptions::splat_scale, median depths and normals (the reason's {} is one of both).
    Lack no_counts{}, no_depth{}, no_scale{}, no_surface{};
    // Cameras: other lenses than pinholes, orthographic ones, rolling shutters.
    Lack no_lens{}, no_parallel_rays{}, no_rolling_shutter{};
    // Trainings: training at all, several views or portions in a step, images by the trainer, relocation of splats of low opacity,
    // faint splats of what few images show, and the largest weight of a splat at a pixel.
    Lack no_training{}, no_division{}, no_trainer_image{}, no_relocation{}, no_faintness{}, no_weight{};
    // Gradients: of the camera's motion, of depths, of a pixel's transmittance, of the sky, and absolute ones of single pixels.
    Lack no_camera_gradient{}, no_depth_gradient{}, no_alpha_gradient{}, no_sky_gradient{},
        no_pixel_gradient{};
};

const Method& method_of(MethodKind kind);
/// The method that the options select. Throws InputError if they select two.
const Method& method_of(const RenderOptions& render);

/// An option that needs an ability of the method of drawing.
template <class Options>
struct Demand {
    std::string_view option;
    bool (*used)(const Options&);
    Lack Method::*lack;
    bool leads = false;  // errors write the option before the method
};

/// Throws InputError, which names the option, if `lack` is true. lack: of this method.
void refuse(const Method& method, const Lack& lack, std::string_view option, bool leads);

/// Throws InputError for the first row whose option is used and needs an ability that the method lacks.
template <class Rows, class Options>
void check_demands(const Rows& rows, const Options& options, const Method& method) {
    for (const Demand<Options>& row : rows)
        if (row.used(options)) refuse(method, method.*row.lack, row.option, row.leads);
}

}  // namespace ewa::scene
