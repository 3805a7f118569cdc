// SPDX-License-Identifier: Apache-2.0
// The arrays of a splat scene, for functions that treat all of them alike.
#pragma once
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <type_traits>
#include <vector>

#include "ewa/gaussians.h"
#include "shared/constants.h"

namespace ewa::scene {

/// One array of a scene. Floats: std::vector<float>, const or not.
template <class Floats>
struct SplatArray {
    Floats* values;
    size_t each;  // number of values of a splat
};

/// The five arrays of the scene. gaussians: Gaussians, const or not, which must outlive them.
template <class Scene>
auto arrays_of(Scene& gaussians) {
    using Floats = std::remove_reference_t<decltype((gaussians.means))>;
    return std::array<SplatArray<Floats>, 5>{{{&gaussians.means, 3},
                                              {&gaussians.quaternions, 4},
                                              {&gaussians.log_scales, 3},
                                              {&gaussians.opacity_logits, 1},
                                              {&gaussians.sh, gaussians.sh_stride()}}};
}

/// Copies `count` splats of one scene, from splat i on, to another of the same SH degree, from splat k on. Both have room.
inline void copy_splats(const Gaussians& from, size_t i, size_t count, Gaussians& to, size_t k) {
    const auto sources = arrays_of(from);
    const auto targets = arrays_of(to);
    for (size_t a = 0; a < sources.size(); ++a) {
        const size_t each = sources[a].each;
        std::copy_n(sources[a].values->data() + each * i, each * count, targets[a].values->data() + each * k);
    }
}

/// Some splats of a scene, in this order. rows: a range of indices below size().
template <class Rows>
Gaussians rows_of(const Gaussians& gaussians, const Rows& rows) {
    Gaussians some;
    some.sh_degree = gaussians.sh_degree;
    some.origin = gaussians.origin;
    some.density = gaussians.density;
    some.resize(rows.size());
    size_t k = 0;
    for (const size_t row : rows) copy_splats(gaussians, row, 1, some, k++);
    return some;
}

/// How many splats are not drawable by which values, such as "means of 2, zero quaternions of 1". Empty if all are drawable.
std::string undrawable_text(const Gaussians& gaussians);

/// The logit of the largest opacity below 1 in float32, and the logarithm of 1e12: a splat of that size covers any view alike,
/// and its footprint stays below FOOTPRINT_MAX.
inline constexpr float kOpaqueLogit = 17.328680f, kLargestLogScale = 27.631f;

/// Finite values that replace stored ones in computations: infinite opacity logits, scales of 0, and scales larger than any view.
/// Renders stay the same.
inline float computable_logit(float logit) {
    return std::isinf(logit) ? std::copysign(kOpaqueLogit, logit) : logit;
}
inline float computable_log_scale(float log_scale) {
    if (std::isinf(log_scale)) return log_scale < 0 ? float(shared::LOG_SCALE_MIN) : log_scale;
    return log_scale > kLargestLogScale ? kLargestLogScale : log_scale;
}

/// Whether computable() changes no value of the scene.
inline bool is_computable(const Gaussians& g) {
    return std::ranges::none_of(g.opacity_logits, [](float v) { return std::isinf(v); }) &&
           std::ranges::all_of(g.log_scales,
                               [](float v) { return computable_log_scale(v) == v || std::isnan(v); });
}

/// The scene with computable_logit and computable_log_scale applied.
inline Gaussians computable(Gaussians g) {
    std::ranges::transform(g.opacity_logits, g.opacity_logits.begin(), computable_logit);
    std::ranges::transform(g.log_scales, g.log_scales.begin(), computable_log_scale);
    return g;
}

}  // namespace ewa::scene
