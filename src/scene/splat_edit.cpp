// SPDX-License-Identifier: Apache-2.0
// Selecting, ordering and joining splats.
#include "ewa/splat_edit.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <limits>

namespace ewa {

namespace {

constexpr int kMortonBits = 21;  // three axes fill 63 bits

/// `stride` values a splat, taken in the order of the indices.
void select_values(std::vector<float>& values, size_t stride, const std::vector<uint32_t>& indices) {
    std::vector<float> selected(indices.size() * stride);
    for (size_t i = 0; i < indices.size(); ++i) {
        assert((indices[i] + size_t(1)) * stride <= values.size());
        std::copy_n(values.data() + indices[i] * stride, stride, selected.data() + i * stride);
    }
    values = std::move(selected);
}

/// The lowest 21 bits, two zero bits between each and the next.
uint64_t spread_bits(uint64_t v) {
    v = (v | v << 32) & 0x1f00000000ffffull;
    v = (v | v << 16) & 0x1f0000ff0000ffull;
    v = (v | v << 8) & 0x100f00f00f00f00full;
    v = (v | v << 4) & 0x10c30c30c30c30c3ull;
    return (v | v << 2) & 0x1249249249249249ull;
}

struct Bounds {
    std::array<double, 3> low{}, high{};
};

bool finite_mean(const Gaussians& g, size_t i) {
    return std::isfinite(g.means[3 * i]) && std::isfinite(g.means[3 * i + 1]) &&
           std::isfinite(g.means[3 * i + 2]);
}

Bounds bounds_of(const Gaussians& g) {
    Bounds bounds;
    bounds.low.fill(std::numeric_limits<double>::infinity());
    bounds.high.fill(-std::numeric_limits<double>::infinity());
    for (size_t i = 0; i < g.size(); ++i)
        for (size_t axis = 0; axis < 3 && finite_mean(g, i); ++axis) {
            bounds.low[axis] = std::min(bounds.low[axis], double(g.means[3 * i + axis]));
            bounds.high[axis] = std::max(bounds.high[axis], double(g.means[3 * i + axis]));
        }
    return bounds;
}

}  // namespace

void select_splats(Gaussians& gaussians, const std::vector<uint32_t>& indices) {
    select_values(gaussians.means, 3, indices);
    select_values(gaussians.quaternions, 4, indices);
    select_values(gaussians.log_scales, 3, indices);
    select_values(gaussians.sh, gaussians.sh_stride(), indices);
    select_values(gaussians.opacity_logits, 1, indices);
}

void set_sh_degree(Gaussians& gaussians, int degree) {
    assert(degree >= 0 && degree <= kMaxShDegree);
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
    const Bounds bounds = bounds_of(gaussians);
    struct Entry {
        uint64_t code;
        uint32_t index;
    };
    assert(gaussians.size() <= std::numeric_limits<uint32_t>::max());
    std::vector<Entry> entries(gaussians.size());
    constexpr double kLargest = double((1u << kMortonBits) - 1);
    for (size_t i = 0; i < gaussians.size(); ++i) {
        uint64_t code = 0;
        for (size_t axis = 0; axis < 3 && finite_mean(gaussians, i); ++axis) {
            const double range = bounds.high[axis] - bounds.low[axis];
            const double place =
                range > 0 ? (double(gaussians.means[3 * i + axis]) - bounds.low[axis]) / range : 0;
            code |= spread_bits(uint64_t(place * kLargest)) << axis;
        }
        if (!finite_mean(gaussians, i)) code = std::numeric_limits<uint64_t>::max();
        entries[i] = {code, uint32_t(i)};
    }
    std::sort(entries.begin(), entries.end(), [](const Entry& a, const Entry& b) {
        return a.code != b.code ? a.code < b.code : a.index < b.index;
    });
    std::vector<uint32_t> order(entries.size());
    for (size_t i = 0; i < order.size(); ++i) order[i] = entries[i].index;
    return order;
}

}  // namespace ewa
