// SPDX-License-Identifier: Apache-2.0
#include "ewa/gaussians.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "core/text.h"
#include "ewa/dataset.h"
#include "ewa/error.h"
#include "scene/statistics.h"
#include "shared/constants.h"

namespace ewa {

namespace {
constexpr double kInitialOpacity = 0.1;
constexpr double kMinSquaredDistance = 1e-7;  // keeps the logarithm of a duplicate's scale finite
constexpr double kLonelyScale = 1.0;          // world units; a single point has no neighbour for its scale

/// Whole units near the middle of most positions if that is far from the world's origin, else zero.
glm::dvec3 origin_for(const std::vector<glm::dvec3>& positions) {
    constexpr double kFar = 64, kLeast = 1000, kOutermost = 0.05;
    glm::dvec3 middle(0);
    double size = 0, distance = 0;
    std::vector<double> values;
    for (int axis = 0; axis < 3; ++axis) {
        values.clear();
        for (const glm::dvec3& p : positions)
            if (std::isfinite(p[axis])) values.push_back(p[axis]);
        if (values.empty()) return glm::dvec3(0);
        const double low = scene::quantile(values, kOutermost),
                     high = scene::quantile(values, 1 - kOutermost);
        middle[axis] = low / 2 + high / 2;
        size = std::max(size, high - low);
        distance = std::max(distance, std::abs(middle[axis]));
    }
    if (!(distance > kLeast && distance > kFar * size && distance < 1e15)) return glm::dvec3(0);
    return {std::round(middle.x), std::round(middle.y), std::round(middle.z)};
}

bool has_degree(const Gaussians& g) {
    return g.sh_degree >= 0 && g.sh_degree <= kMaxShDegree;
}

/// Fast, for what is called for each splat.
bool fit(const Gaussians& g) {
    const size_t n = g.size();
    return has_degree(g) && g.means.size() == 3 * n && g.quaternions.size() == 4 * n &&
           g.log_scales.size() == 3 * n && g.sh.size() == n * g.sh_stride();
}

}  // namespace

void check(const Gaussians& gaussians) {
    if (fit(gaussians)) return;
    if (!has_degree(gaussians))
        throw InputError("sh_degree is " + std::to_string(gaussians.sh_degree) + "; it can be 0 to " +
                         std::to_string(kMaxShDegree));
    struct Array {
        const char* name;
        size_t size, each;
    };
    const std::array<Array, 5> arrays{{{"means", gaussians.means.size(), 3},
                                       {"quaternions", gaussians.quaternions.size(), 4},
                                       {"log_scales", gaussians.log_scales.size(), 3},
                                       {"opacity_logits", gaussians.opacity_logits.size(), 1},
                                       {"sh", gaussians.sh.size(), gaussians.sh_stride()}}};
    // What most arrays have room for is the number of splats.
    const auto fitting = [&](size_t splats) {
        return std::ranges::count_if(arrays, [&](const Array& a) { return a.size == a.each * splats; });
    };
    size_t splats = gaussians.size();
    for (const Array& a : arrays)
        if (fitting(a.size / a.each) > fitting(splats)) splats = a.size / a.each;
    const auto wrong =
        *std::ranges::find_if(arrays, [&](const Array& a) { return a.size != a.each * splats; });
    std::string whose = core::grouped(splats, "splat");
    if (wrong.name == std::string_view("sh")) whose += " of sh_degree " + std::to_string(gaussians.sh_degree);
    throw core::wrong_length(wrong.name, wrong.size, whose + (splats == 1 ? " needs" : " need"),
                             wrong.each * splats);
}

int sh_degree_present(const Gaussians& gaussians) {
    check(gaussians);
    const size_t stride = gaussians.sh_stride();
    for (int degree = gaussians.sh_degree; degree > 0; --degree) {
        const size_t begin = size_t(sh_coefficients(degree - 1)) * 3,
                     end = size_t(sh_coefficients(degree)) * 3;
        for (size_t splat = 0; splat < gaussians.size(); ++splat) {
            const float* sh = &gaussians.sh[splat * stride];
            // NaN counts as present, so that it reaches the check that reports it.
            if (std::any_of(sh + begin, sh + end, [](float v) { return v != 0.0f; })) return degree;
        }
    }
    return 0;
}

void set_world_means(Gaussians& gaussians, const std::vector<glm::dvec3>& positions) {
    check(gaussians);
    if (positions.size() != gaussians.size())
        throw InputError(core::grouped(positions.size()) + " positions for " +
                         core::grouped(gaussians.size(), "splat"));
    gaussians.origin = origin_for(positions);
    gaussians.means.resize(3 * positions.size());
    for (size_t i = 0; i < positions.size(); ++i)
        for (int axis = 0; axis < 3; ++axis)
            gaussians.means[3 * i + size_t(axis)] = float(positions[i][axis] - gaussians.origin[axis]);
}

void settle_origin(Gaussians& gaussians) {
    check(gaussians);
    std::vector<glm::dvec3> positions(gaussians.size());
    for (size_t i = 0; i < positions.size(); ++i) positions[i] = gaussians.world_mean(i);
    set_world_means(gaussians, positions);
}

Gaussians gaussians_from_points(const PointCloud& points, int sh_degree) {
    Gaussians gaussians;
    gaussians.sh_degree = sh_degree;
    check(gaussians);
    if (points.positions.empty()) throw InputError("there are no points to create splats from");
    if (points.colors.size() != points.positions.size())
        throw InputError(std::to_string(points.positions.size()) + " points have " +
                         std::to_string(points.colors.size()) + " colours");
    const size_t n = points.positions.size();
    for (size_t i = 0; i < n; ++i)
        for (int axis = 0; axis < 3; ++axis)
            if (!std::isfinite(static_cast<float>(points.positions[i][axis])))
                throw InputError("point " + std::to_string(i) + " has a coordinate that is not finite");

    const std::vector<double> squared = scene::mean_squared_neighbor_distance(points.positions);
    gaussians.resize(n);
    set_world_means(gaussians, points.positions);
    for (size_t i = 0; i < n; ++i) {
        const double scale =
            squared[i] < 0 ? kLonelyScale : std::sqrt(std::max(squared[i], kMinSquaredDistance));
        for (int axis = 0; axis < 3; ++axis) {
            gaussians.log_scales[3 * i + size_t(axis)] = static_cast<float>(std::log(scale));
            gaussians.sh[gaussians.sh_stride() * i + size_t(axis)] = static_cast<float>(
                (points.colors[i][size_t(axis)] / 255.0 - shared::COLOR_OFFSET) / shared::SH_C0);
        }
        gaussians.quaternions[4 * i] = 1;
        gaussians.opacity_logits[i] = static_cast<float>(std::log(kInitialOpacity / (1 - kInitialOpacity)));
    }
    return gaussians;
}

}  // namespace ewa
