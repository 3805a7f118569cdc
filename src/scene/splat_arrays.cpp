// SPDX-License-Identifier: Apache-2.0
#include "scene/splat_arrays.h"

#include <limits>

#include "ewa/error.h"

namespace ewa {

namespace {

enum Part : size_t { kMeans, kQuaternions, kZeroQuaternions, kScales, kOpacities, kSh, kDrawable };
constexpr std::array<const char*, kDrawable> kPartNames = {"means",  "quaternions", "zero quaternions",
                                                           "scales", "opacities",   "SH coefficients"};

/// The values that make splat i undrawable.
Part undrawable_part(const Gaussians& g, size_t i) {
    const auto all = [](const float* values, size_t count, auto good) {
        return std::all_of(values, values + count, good);
    };
    const auto finite = [](float v) { return std::isfinite(v); };
    const float* q = &g.quaternions[4 * i];
    if (!all(&g.means[3 * i], 3, finite)) return kMeans;
    if (!all(q, 4, finite)) return kQuaternions;
    if (all(q, 4, [](float v) { return v == 0; })) return kZeroQuaternions;
    if (!all(&g.log_scales[3 * i], 3, [](float v) { return v < std::numeric_limits<float>::infinity(); }))
        return kScales;
    if (std::isnan(g.opacity_logits[i])) return kOpacities;
    return all(&g.sh[g.sh_stride() * i], g.sh_stride(), finite) ? kDrawable : kSh;
}

}  // namespace

bool drawable(const Gaussians& gaussians, size_t i) {
    check(gaussians);
    if (i >= gaussians.size())
        throw InputError("there is no splat " + std::to_string(i) + " in a scene of " +
                         std::to_string(gaussians.size()));
    return undrawable_part(gaussians, i) == kDrawable;
}

namespace scene {

std::string undrawable_text(const Gaussians& gaussians) {
    std::array<uint64_t, kDrawable> counts{};
    for (size_t i = 0; i < gaussians.size(); ++i)
        if (const Part part = undrawable_part(gaussians, i); part != kDrawable) ++counts[part];
    std::string text;
    for (size_t part = 0; part < counts.size(); ++part)
        if (counts[part] > 0)
            text += (text.empty() ? "" : ", ") + std::string(kPartNames[part]) + " of " +
                    std::to_string(counts[part]);
    return text;
}

}  // namespace scene

}  // namespace ewa
