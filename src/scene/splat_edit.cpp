// SPDX-License-Identifier: Apache-2.0
// Selection, order, concatenation and affine transforms of splats.
#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <functional>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>
#include <glm/mat3x3.hpp>
#include <glm/matrix.hpp>
#include <limits>
#include <numbers>

#include "ewa/error.h"
#include "ewa/splat_edit.h"
#include "scene/color.h"
#include "scene/splat_arrays.h"
#include "scene/splat_shape.h"

namespace ewa {

namespace {

constexpr int kMortonBits = 21;  // three axes fill 63 bits

/// Keeps the values of the indexed splats, `stride` values per splat.
void select_values(std::vector<float>& values, size_t stride, const std::vector<uint32_t>& indices) {
    std::vector<float> selected(indices.size() * stride);
    for (size_t i = 0; i < indices.size(); ++i)
        std::copy_n(values.data() + indices[i] * stride, stride, selected.data() + i * stride);
    values = std::move(selected);
}

/// Spreads the lowest 21 bits, with two zero bits between neighbours.
uint64_t spread_bits(uint64_t v) {
    v = (v | v << 32) & 0x1f00000000ffffull;
    v = (v | v << 16) & 0x1f0000ff0000ffull;
    v = (v | v << 8) & 0x100f00f00f00f00full;
    v = (v | v << 4) & 0x10c30c30c30c30c3ull;
    return (v | v << 2) & 0x1249249249249249ull;
}

struct Bounds {
    glm::dvec3 low{std::numeric_limits<double>::infinity()}, high{-std::numeric_limits<double>::infinity()};
};

bool finite_mean(const Gaussians& g, size_t i) {
    return std::isfinite(g.means[3 * i]) && std::isfinite(g.means[3 * i + 1]) &&
           std::isfinite(g.means[3 * i + 2]);
}

Bounds bounds_of(const Gaussians& g) {
    Bounds bounds;
    for (size_t i = 0; i < g.size(); ++i) {
        if (!finite_mean(g, i)) continue;
        const glm::dvec3 mean(g.means[3 * i], g.means[3 * i + 1], g.means[3 * i + 2]);
        bounds.low = glm::min(bounds.low, mean);
        bounds.high = glm::max(bounds.high, mean);
    }
    return bounds;
}

using scene::decompose;
using scene::Decomposition;
using scene::kMaxShCoefficients;
using scene::right_handed;
using scene::sh_basis;
using ShMatrix = std::array<std::array<double, kMaxShCoefficients>, kMaxShCoefficients>;

/// Snaps a value near a whole number to it, so that turns by 90 degrees are exact.
double snapped(double v) {
    const double whole = std::round(v);
    return std::abs(v - whole) < 1e-12 ? whole : v;
}

/// D with c' = D c for f'(d) = f(O^T d), O orthogonal. D_jk is the integral of Y_j(d) Y_k(O^T d) over the
/// sphere. The Gauss-Legendre rule with 4 nodes in z and 8 even angles is exact for degree 3.
ShMatrix sh_rotation(const glm::dmat3& orthogonal, int degree) {
    constexpr int kAngles = 8;
    const double inner = std::sqrt(3.0 / 7 - 2.0 / 7 * std::sqrt(6.0 / 5)),
                 outer = std::sqrt(3.0 / 7 + 2.0 / 7 * std::sqrt(6.0 / 5));
    const double inner_weight = (18 + std::sqrt(30.0)) / 36, outer_weight = (18 - std::sqrt(30.0)) / 36;
    const double nodes[4][2] = {
        {-outer, outer_weight}, {-inner, inner_weight}, {inner, inner_weight}, {outer, outer_weight}};
    ShMatrix d{};
    const int count = sh_coefficients(degree);
    for (const auto& [z, weight] : nodes)
        for (int a = 0; a < kAngles; ++a) {
            const double angle = 2 * std::numbers::pi * (a + 0.5) / kAngles, r = std::sqrt(1 - z * z);
            const glm::dvec3 direction(r * std::cos(angle), r * std::sin(angle), z);
            const auto here = sh_basis(degree, direction);
            const auto there = sh_basis(degree, glm::transpose(orthogonal) * direction);
            for (int j = 0; j < count; ++j)
                for (int k = 0; k < count; ++k)
                    d[size_t(j)][size_t(k)] +=
                        weight * 2 * std::numbers::pi / kAngles * here[size_t(j)] * there[size_t(k)];
        }
    for (auto& row : d)
        for (double& v : row) v = snapped(v);
    return d;
}

void turn_sh(Gaussians& gaussians, const glm::dmat3& orthogonal) {
    if (gaussians.sh_degree == 0) return;
    const ShMatrix d = sh_rotation(orthogonal, gaussians.sh_degree);
    const size_t count = size_t(sh_coefficients(gaussians.sh_degree)), stride = gaussians.sh_stride();
    std::array<double, kMaxShCoefficients> turned{};
    for (size_t i = 0; i < gaussians.size(); ++i)
        for (size_t channel = 0; channel < 3; ++channel) {
            float* sh = &gaussians.sh[i * stride + channel];
            for (size_t j = 1; j < count; ++j) {
                turned[j] = 0;
                for (size_t k = 1; k < count; ++k)
                    if (d[j][k] != 0) turned[j] += d[j][k] * double(sh[3 * k]);
            }
            for (size_t j = 1; j < count; ++j) sh[3 * j] = float(turned[j]);
        }
}

void move_means(Gaussians& gaussians, const glm::dmat4& matrix) {
    std::vector<glm::dvec3> positions(gaussians.size());
    for (size_t i = 0; i < positions.size(); ++i)
        positions[i] = glm::dvec3(matrix * glm::dvec4(gaussians.world_mean(i), 1));
    set_world_means(gaussians, positions);
}

/// Transforms quaternions and scales by M = scale * rotation.
void turn_similar(Gaussians& gaussians, const glm::dquat& rotation, double scale) {
    const double grown = std::log(scale);
    for (size_t i = 0; i < gaussians.size(); ++i) {
        float* q = &gaussians.quaternions[4 * i];
        const double w = q[0], x = q[1], y = q[2], z = q[3];
        const glm::dquat& r = rotation;
        q[0] = float(r.w * w - r.x * x - r.y * y - r.z * z);
        q[1] = float(r.w * x + r.x * w + r.y * z - r.z * y);
        q[2] = float(r.w * y - r.x * z + r.y * w + r.z * x);
        q[3] = float(r.w * z + r.x * y - r.y * x + r.z * w);
        for (size_t axis = 0; axis < 3; ++axis)
            gaussians.log_scales[3 * i + axis] = float(double(gaussians.log_scales[3 * i + axis]) + grown);
    }
}

/// Transforms quaternions and scales by any M. The singular value decomposition of M R S has the factors of
/// Sigma' = (M R S)(M R S)^T. Scales are relative to the largest, so that none overflows.
void turn_general(Gaussians& gaussians, const glm::dmat3& linear) {
    for (size_t i = 0; i < gaussians.size(); ++i) {
        float* q = &gaussians.quaternions[4 * i];
        float* log_scale = &gaussians.log_scales[3 * i];
        if (!drawable(gaussians, i)) continue;
        const glm::dmat3 rotation = glm::mat3_cast(glm::normalize(glm::dquat(q[0], q[1], q[2], q[3])));
        // A splat may be flat along all axes.
        const double largest =
            std::max({log_scale[0], log_scale[1], log_scale[2], std::numeric_limits<float>::lowest()});
        glm::dmat3 factor = linear * rotation;
        for (int axis = 0; axis < 3; ++axis) factor[axis] *= std::exp(log_scale[axis] - largest);
        const Decomposition parts = decompose(factor);
        const glm::dquat turned = glm::normalize(glm::quat_cast(right_handed(parts.u)));
        q[0] = float(turned.w), q[1] = float(turned.x), q[2] = float(turned.y), q[3] = float(turned.z);
        for (int axis = 0; axis < 3; ++axis)
            log_scale[axis] =
                float(largest + std::log(std::max(parts.s[axis], double(std::numeric_limits<float>::min()))));
    }
}

/// Also the scene's own lengths.
void check_indices(const Gaussians& gaussians, const std::vector<uint32_t>& indices) {
    check(gaussians);
    const auto wrong = std::ranges::find_if(indices, [&](uint32_t i) { return i >= gaussians.size(); });
    if (wrong != indices.end())
        throw InputError("there is no splat " + std::to_string(*wrong) + " in a scene of " +
                         std::to_string(gaussians.size()));
}

}  // namespace

void select_splats(Gaussians& gaussians, const std::vector<uint32_t>& indices) {
    check_indices(gaussians, indices);
    for (const auto& [values, each] : scene::arrays_of(gaussians)) select_values(*values, each, indices);
}

void keep_splats(Gaussians& gaussians, const std::vector<uint32_t>& indices) {
    check_indices(gaussians, indices);
    if (std::ranges::adjacent_find(indices, std::greater_equal()) != indices.end())
        throw InputError("keep_splats takes ascending indices; select_splats takes others");
    for (const auto& [values, each] : scene::arrays_of(gaussians)) {
        for (size_t i = 0; i < indices.size(); ++i)
            if (indices[i] != i)
                std::copy_n(values->data() + indices[i] * each, each, values->data() + i * each);
        values->resize(indices.size() * each);
    }
}

void set_sh_degree(Gaussians& gaussians, int degree) {
    check(gaussians);
    if (degree < 0 || degree > kMaxShDegree)
        throw InputError("an SH degree of " + std::to_string(degree) + "; it can be 0 to " +
                         std::to_string(kMaxShDegree));
    if (degree == gaussians.sh_degree) return;
    const size_t n = gaussians.size(), from = gaussians.sh_stride();
    gaussians.sh_degree = degree;
    const size_t to = gaussians.sh_stride();
    std::vector<float> sh(n * to);
    for (size_t i = 0; i < n; ++i)
        std::copy_n(gaussians.sh.data() + i * from, std::min(from, to), sh.data() + i * to);
    gaussians.sh = std::move(sh);
}

void append_splats(Gaussians& gaussians, const Gaussians& more) {
    check(gaussians);
    check(more);
    if (&gaussians == &more) return append_splats(gaussians, Gaussians(more));
    if (gaussians.size() == 0) gaussians.density = more.density;
    if (gaussians.density != more.density) {
        fit_opacities(gaussians, false);
        Gaussians fitted = more;
        fit_opacities(fitted, false);
        return append_splats(gaussians, fitted);
    }
    const int degree = std::max(gaussians.sh_degree, more.sh_degree);
    set_sh_degree(gaussians, degree);
    const auto append = [](std::vector<float>& to, const std::vector<float>& from) {
        to.insert(to.end(), from.begin(), from.end());
    };
    if (gaussians.size() == 0) gaussians.origin = more.origin;
    const glm::dvec3 apart = more.origin - gaussians.origin;
    for (size_t i = 0; i < more.means.size(); ++i)
        gaussians.means.push_back(apart == glm::dvec3(0) ? more.means[i]
                                                         : float(more.means[i] + apart[int(i % 3)]));
    append(gaussians.quaternions, more.quaternions);
    append(gaussians.log_scales, more.log_scales);
    append(gaussians.opacity_logits, more.opacity_logits);
    if (more.sh_degree == degree) return append(gaussians.sh, more.sh);
    const size_t from = more.sh_stride(), to = gaussians.sh_stride();
    gaussians.sh.resize(gaussians.size() * to);
    float* target = gaussians.sh.data() + (gaussians.size() - more.size()) * to;
    for (size_t i = 0; i < more.size(); ++i) std::copy_n(more.sh.data() + i * from, from, target + i * to);
}

std::vector<uint32_t> morton_order(const Gaussians& gaussians) {
    check(gaussians);
    const Bounds bounds = bounds_of(gaussians);
    struct Entry {
        uint64_t code;
        uint32_t index;
    };
    assert(gaussians.size() <= std::numeric_limits<uint32_t>::max());
    std::vector<Entry> entries(gaussians.size());
    constexpr double kLargest = double((1u << kMortonBits) - 1);
    for (size_t i = 0; i < gaussians.size(); ++i) {
        entries[i] = {finite_mean(gaussians, i) ? 0 : std::numeric_limits<uint64_t>::max(), uint32_t(i)};
        for (int axis = 0; axis < 3 && finite_mean(gaussians, i); ++axis) {
            const double range = bounds.high[axis] - bounds.low[axis];
            const double share =
                range > 0 ? (double(gaussians.means[3 * i + size_t(axis)]) - bounds.low[axis]) / range : 0;
            entries[i].code |= spread_bits(uint64_t(share * kLargest)) << axis;
        }
    }
    std::sort(entries.begin(), entries.end(), [](const Entry& a, const Entry& b) {
        return a.code != b.code ? a.code < b.code : a.index < b.index;
    });
    std::vector<uint32_t> order(entries.size());
    for (size_t i = 0; i < order.size(); ++i) order[i] = entries[i].index;
    return order;
}

void transform_splats(Gaussians& gaussians, const glm::dmat4& matrix) {
    check(gaussians);
    scene::check_transform(matrix);
    const glm::dmat3 linear(matrix);
    const double determinant = glm::determinant(linear);
    if (matrix == glm::dmat4(1.0)) return;
    move_means(gaussians, matrix);
    if (linear == glm::dmat3(1.0)) return;

    const Decomposition parts = decompose(linear);
    const glm::dmat3 orthogonal = parts.u * glm::transpose(parts.v);  // of the polar decomposition of M
    glm::dmat3 exact = orthogonal;
    for (int column = 0; column < 3; ++column)
        for (int row = 0; row < 3; ++row) exact[column][row] = snapped(orthogonal[column][row]);
    const double largest = std::max({parts.s.x, parts.s.y, parts.s.z}),
                 least = std::min({parts.s.x, parts.s.y, parts.s.z});
    if (least <= 1e-12 * largest) throw InputError("the transform flattens space along an axis");
    // M and -M have the same effect on a covariance.
    if (largest - least <= 1e-9 * largest)
        turn_similar(gaussians, glm::quat_cast(determinant < 0 ? -exact : exact),
                     std::cbrt(std::abs(determinant)));
    else
        turn_general(gaussians, linear);
    turn_sh(gaussians, exact);
}

}  // namespace ewa
