// SPDX-License-Identifier: Apache-2.0
#include "reference/training.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <numbers>

#include "reference/projection.h"
#include "shared/constants.h"

namespace ewa::reference {

using namespace shared;

uint64_t adam_step(std::span<double> values, std::span<const double> gradient, AdamState& state, double rate,
                   int step, bool nesterov) {
    assert(step >= 1);
    assert(gradient.size() == values.size() && state.m.size() == values.size() &&
           state.v.size() == values.size());
    const double correction1 = 1 - std::pow(ADAM_BETA1, step), correction2 = 1 - std::pow(ADAM_BETA2, step);
    const double ahead = 1 - std::pow(ADAM_BETA1, step + 1);
    uint64_t dropped = 0;
    for (size_t i = 0; i < values.size(); ++i) {
        const double g = gradient[i];
        const double m = ADAM_BETA1 * state.m[i] + (1 - ADAM_BETA1) * g;
        const double v = ADAM_BETA2 * state.v[i] + (1 - ADAM_BETA2) * g * g;
        const double along =
            nesterov ? ADAM_BETA1 * m / ahead + (1 - ADAM_BETA1) * g / correction1 : m / correction1;
        const double x = values[i] - rate * along / (std::sqrt(v / correction2) + ADAM_EPSILON);
        if (!(std::isfinite(m) && std::isfinite(v) && std::isfinite(x))) {
            ++dropped;
            continue;
        }
        state.m[i] = m;
        state.v[i] = v;
        values[i] = x;
    }
    return dropped;
}

namespace {

/// value / 2^exponent in units of 2^-digits, rounded up where the rest and random, both below 1, reach 1 together.
int64_t rounded_at_random(double value, int exponent, int digits, double random) {
    const double units = std::ldexp(value, digits - exponent), whole = std::floor(units);
    return int64_t(whole) + (units - whole + random >= 1);
}

constexpr int kFirstDigits = 7, kRootDigits = 9;
constexpr int kLeastFirst = -126, kLeastRoot = -63;  // exponents of 2

}  // namespace

uint32_t packed_moments(double first, double second, uint32_t random) {
    const double size = std::abs(first), root = double(std::sqrt(float(second)));
    // Below the least normal number, bfloat16 has steps of one size.
    const int exponent = size > 0 ? std::max(std::ilogb(size), kLeastFirst) : kLeastFirst;
    int64_t high = rounded_at_random(size, exponent, kFirstDigits, (random & 0xffffu) / 65536.0);
    high += int64_t(exponent - kLeastFirst) << kFirstDigits;
    if (std::signbit(first)) high |= 0x8000;
    int64_t low = 0;
    if (root >= std::ldexp(1.0, kLeastRoot)) {
        const int scale = std::ilogb(root);
        low = rounded_at_random(root, scale, kRootDigits, (random >> 18) / 16384.0);
        low += (int64_t(scale - kLeastRoot) << kRootDigits) - (int64_t(1) << kRootDigits);
    }
    return uint32_t(high << 16 | low);
}

AdamMoments unpacked_moments(uint32_t word) {
    const uint32_t high = word >> 16 & 0x7fffu, low = word & 0xffffu;
    const int exponent = int(high >> kFirstDigits);
    const double digits = double(high & 127u) / 128;
    const double first =
        exponent == 0 ? std::ldexp(digits, kLeastFirst) : std::ldexp(1 + digits, exponent - 1 + kLeastFirst);
    const double root =
        low == 0 ? 0 : std::ldexp(1 + double(low & 511u) / 512, int(low >> kRootDigits) + kLeastRoot);
    return {word >> 31 ? -first : first, root * root};
}

namespace {

glm::dmat3 rotation_of(const Splat& splat) {
    const double norm = robust_norm(splat.quaternion);
    std::array<double, 4> unit{};
    for (size_t k = 0; k < 4; ++k) unit[k] = splat.quaternion[k] / norm;
    return rotation_matrix(unit);
}

}  // namespace

void accumulate(DensifyStatistics& statistics, std::span<const ScreenGradient> gradients,
                std::span<const uint8_t> in_view, const Camera& camera, bool absolute) {
    assert(gradients.size() == in_view.size() && statistics.views.size() == in_view.size());
    for (size_t i = 0; i < gradients.size(); ++i) {
        if (!in_view[i]) continue;
        const glm::dvec2 by_mean = absolute ? gradients[i].absolute : gradients[i].mean2d;
        statistics.gradient_sum[i] += std::hypot(by_mean.x * camera.width / 2, by_mean.y * camera.height / 2);
        ++statistics.views[i];
    }
}

bool Region::contains(const glm::dvec3& point) const {
    for (int axis = 0; axis < 3; ++axis)
        if (point[axis] < low[axis] || point[axis] > high[axis]) return false;
    return true;
}

Decision decide(const Splat& splat, double mean_gradient, const DensifyOptions& options) {
    const double opacity = 1 / (1 + std::exp(-splat.opacity_logit));
    // With this comparison, an opacity of NaN is pruned.
    if (!(opacity >= options.prune_opacity)) return Decision::prune;
    const double scale = std::exp(std::max({splat.log_scale.x, splat.log_scale.y, splat.log_scale.z}));
    if (scale > glm::length(splat.mean - options.ball.middle) + options.ball.radius) return Decision::prune;
    const bool grows = mean_gradient >= options.grow_gradient && options.region.contains(splat.mean);
    const bool splits = grows && scale > options.split_scale * options.extent;
    const double left = splits ? scale / SPLIT_SCALE : scale;
    if (options.prune_large && left > options.prune_scale * options.extent) return Decision::prune;
    if (splits) return Decision::split;
    return grows ? Decision::clone : Decision::keep;
}

std::vector<Decision> decide(const Values& values, const DensifyStatistics& statistics,
                             const DensifyOptions& options) {
    assert(statistics.views.size() == values.size());
    std::vector<Decision> decisions;
    uint64_t left = 0;
    for (size_t i = 0; i < values.size(); ++i) {
        const double mean = statistics.views[i] ? statistics.gradient_sum[i] / statistics.views[i] : 0;
        decisions.push_back(decide(read_splat(values, i), mean, options));
        if (decisions.back() != Decision::prune) ++left;
    }
    uint64_t capacity = options.max_splats > left ? options.max_splats - left : 0;
    for (Decision& decision : decisions) {
        if (decision != Decision::clone && decision != Decision::split) continue;
        if (capacity == 0)
            decision = Decision::keep;
        else
            --capacity;
    }
    return decisions;
}

Splat split_child(const Splat& parent, const glm::dvec3& normal) {
    Splat child = parent;
    glm::dvec3 step(0);
    for (int k = 0; k < 3; ++k) {
        step[k] = std::exp(parent.log_scale[k]) * normal[k];
        child.log_scale[k] = parent.log_scale[k] - std::log(SPLIT_SCALE);
    }
    child.mean += rotation_of(parent) * step;
    return child;
}

Splat thinned(Splat splat, double share) {
    // The thickness is -ln(1 - opacity).
    const double thickness =
        share * (std::max(splat.opacity_logit, 0.0) + std::log1p(std::exp(-std::abs(splat.opacity_logit))));
    splat.opacity_logit = std::log(-std::expm1(-thickness)) + thickness;
    return splat;
}

Splat even_child(const Splat& parent, bool forward) {
    Splat child = thinned(parent, EVEN_SHARE);
    int axis = 0;
    for (int k = 1; k < 3; ++k)
        if (parent.log_scale[k] > parent.log_scale[axis]) axis = k;
    const double length = EVEN_OFFSET * std::exp(parent.log_scale[axis]);
    child.mean += (forward ? length : -length) * rotation_of(parent)[axis];
    child.log_scale[axis] += std::log(EVEN_SCALE);
    return child;
}

Densified densify(const Values& values, std::span<const Decision> decisions,
                  std::span<const glm::dvec3> normals) {
    assert(decisions.size() == values.size());
    std::vector<Splat> splats;
    Densified out;
    const auto add = [&](const Splat& splat, size_t source, bool fresh) {
        splats.push_back(splat);
        out.source.push_back(uint32_t(source));
        out.fresh.push_back(fresh);
    };
    for (size_t i = 0; i < values.size(); ++i)
        if (decisions[i] == Decision::keep || decisions[i] == Decision::clone)
            add(read_splat(values, i), i, false);
    for (size_t i = 0; i < values.size(); ++i)
        if (decisions[i] == Decision::clone) add(read_splat(values, i), i, true);
    size_t next = 0;
    for (size_t i = 0; i < values.size(); ++i) {
        if (decisions[i] != Decision::split) continue;
        assert(next + 2 <= normals.size());
        const Splat parent = read_splat(values, i);
        for (int child = 0; child < 2; ++child) add(split_child(parent, normals[next++]), i, true);
    }
    out.values.sh_degree = values.sh_degree;
    out.values.resize(splats.size());
    for (size_t i = 0; i < splats.size(); ++i) write_splat(out.values, i, splats[i]);
    return out;
}

void reset_opacity(Values& values, double ceiling) {
    assert(ceiling > 0 && ceiling < 1);
    const double logit = std::log(ceiling / (1 - ceiling));
    for (double& value : values.opacity_logits) value = std::min(value, logit);
}

Share share_of(double opacity, int parts) {
    assert(parts >= 1);
    const double x = -std::expm1(std::log1p(-opacity) / parts);
    // For many parts, the sum cancels in float64 too. The integral (shaders/lib/mcmc.glsl) does not.
    if (parts > 20) {
        double integral = 0;
        for (int j = 0; j < 512; ++j) {
            const double t = j / 64.0;
            integral -= (j == 0 ? 0.5 : 1) * std::expm1(parts * std::log1p(-x * std::exp(-t * t))) / 64.0;
        }
        return {x, opacity / (2 / std::sqrt(std::numbers::pi) * integral)};
    }
    double sum = 0;
    for (int i = 1; i <= parts; ++i) {
        double binomial = 1;  // C(i - 1, k)
        for (int k = 0; k < i; ++k) {
            sum += binomial * (k % 2 == 0 ? 1 : -1) * std::pow(x, k + 1) / std::sqrt(k + 1.0);
            binomial *= double(i - 1 - k) / (k + 1);
        }
    }
    return {x, opacity / sum};
}

std::vector<uint32_t> draw_sources(std::span<const uint32_t> weights, std::span<const uint32_t> random) {
    uint64_t total = 0;
    for (const uint32_t w : weights) total += w;
    std::vector<uint32_t> sources;
    for (const uint32_t r : random) {
        uint64_t target = uint64_t(r) * total >> 32;
        uint32_t e = 0;
        while (target >= weights[e]) target -= weights[e++];
        sources.push_back(e);
    }
    return sources;
}

glm::dvec3 noise(const Splat& splat, const glm::dvec3& normal, double amplitude) {
    const glm::dmat3 rotation = rotation_of(splat);
    glm::dvec3 along = normal * rotation;
    for (int k = 0; k < 3; ++k) along[k] *= std::exp(2 * splat.log_scale[k]);
    const double opacity = 1 / (1 + std::exp(-splat.opacity_logit));
    const double gate = 1 / (1 + std::exp(MCMC_GATE_SLOPE * (opacity - MCMC_GATE_OPACITY)));
    return amplitude * gate * (rotation * along);
}

glm::dvec3 apart(const Splat& source, const glm::dvec3& normal, double spread) {
    glm::dvec3 step(0);
    for (int k = 0; k < 3; ++k) step[k] = spread * std::exp(source.log_scale[k]) * normal[k];
    return source.mean + rotation_of(source) * step;
}

}  // namespace ewa::reference
