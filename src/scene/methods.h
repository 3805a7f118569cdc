// SPDX-License-Identifier: Apache-2.0
// The ways to draw splats, and what each of them lacks. Other code asks for a lack. What knows a method by its name is this table,
// its passes in src/pipeline/methods.cpp, and the options that ask for it.
#pragma once
#include <cstdint>
#include <string_view>

#include "ewa/render_options.h"

namespace ewa::scene {

/// The first ones are those of Integrator.
enum class MethodKind : uint8_t { splat, ray, march, fast_ray, points };

/// True where a method lacks something.
struct Lack {
    std::string_view why = {};  // as errors print it
    bool alone = false;         // other methods with the same option do not lack it
    explicit constexpr operator bool() const { return !why.empty(); }
};

struct Method {
    MethodKind kind = MethodKind::splat;
    std::string_view option = {};   // that asks for it, as errors write it; the usual method has none
    std::string_view full = {};     // the option with its value
    std::string_view subject = {};  // of a sentence
    bool rays = false;              // its frames have the buffer of how rays meet each splat
    float grow_threshold = 1;       // factor of the gradient that adds splats

    // Splats have no opacity and no edge that fades, are not drawn as their linearised projection, or lack a kernel.
    Lack no_opacity{}, no_footprint{}, no_antialias{}, no_density{};
    // In images: counts and ellipsoids, depths, other scales than the splats' own, median depths and normals ({} of the reason).
    Lack no_counts{}, no_depth{}, no_scale{}, no_surface{};
    // Cameras.
    Lack no_lens{}, no_parallel_rays{}, no_rolling_shutter{};
    // In trainings: several views or portions in a step, images by the trainer, splats of low opacity that move, faint splats
    // of what few images show, and the largest weight of a splat at a pixel.
    Lack no_training{}, no_division{}, no_trainer_image{}, no_relocation{}, no_faintness{}, no_weight{};
    // Gradients by the camera's motion, depths, the transmittance of a pixel, and the sky; absolute ones of single pixels.
    Lack no_camera_gradient{}, no_depth_gradient{}, no_alpha_gradient{}, no_sky_gradient{},
        no_pixel_gradient{};
};

const Method& method_of(MethodKind kind);
/// The method that the options ask for. Throws InputError if they ask for two.
const Method& method_of(const RenderOptions& render);

/// An option that the methods with a lack exclude.
template <class Options>
struct Demand {
    std::string_view option;
    bool (*used)(const Options&);
    Lack Method::*lack;
    bool leads = false;  // errors write the option before the method
};

/// Throws InputError if the method has the lack.
void refuse(const Method& method, const Lack& lack, std::string_view option, bool leads);

/// Throws InputError for the first row whose option is used and whose lack the method has.
template <class Rows, class Options>
void check_demands(const Rows& rows, const Options& options, const Method& method) {
    for (const Demand<Options>& row : rows)
        if (row.used(options)) refuse(method, method.*row.lack, row.option, row.leads);
}

}  // namespace ewa::scene
