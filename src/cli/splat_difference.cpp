// SPDX-License-Identifier: Apache-2.0
#include "cli/splat_difference.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "ewa/error.h"
#include "shared/constants.h"

namespace ewa::cli {
namespace {

class Tally {
  public:
    void add(double error) {
        ++count_;
        if (!std::isfinite(error)) error = std::numeric_limits<double>::infinity();
        largest_ = std::max(largest_, error);
        sum_ += error;
    }
    void add(double a, double b) {
        const bool same = a == b || (!std::isfinite(a) && !std::isfinite(b));
        add(same ? 0 : std::abs(a - b));
    }
    Difference named(const char* what, const char* unit) const {
        return {what, unit, largest_, count_ == 0 ? 0 : sum_ / double(count_)};
    }

  private:
    double largest_ = 0, sum_ = 0;
    size_t count_ = 0;
};

/// The angle of the rotation between, from the sine of its half, which is exact for small ones.
double degrees_between(const float* p, const float* q) {
    const double lengths =
        std::sqrt((double(p[0]) * p[0] + double(p[1]) * p[1] + double(p[2]) * p[2] + double(p[3]) * p[3]) *
                  (double(q[0]) * q[0] + double(q[1]) * q[1] + double(q[2]) * q[2] + double(q[3]) * q[3]));
    if (!(lengths > 0) || !std::isfinite(lengths)) return 0;
    const double x = double(p[0]) * q[1] - double(p[1]) * q[0] - double(p[2]) * q[3] + double(p[3]) * q[2];
    const double y = double(p[0]) * q[2] + double(p[1]) * q[3] - double(p[2]) * q[0] - double(p[3]) * q[1];
    const double z = double(p[0]) * q[3] - double(p[1]) * q[2] + double(p[2]) * q[1] - double(p[3]) * q[0];
    const double sine = std::min(std::sqrt(x * x + y * y + z * z) / lengths, 1.0);
    return 2 * std::asin(sine) * 180 / std::numbers::pi;
}

double sigmoid(double x) {
    return 1 / (1 + std::exp(-x));
}

}  // namespace

std::array<Difference, 6> differences(const Gaussians& a, const Gaussians& b) {
    if (a.size() != b.size())
        throw RunError("there are " + std::to_string(a.size()) + " splats on one side and " +
                       std::to_string(b.size()) + " on the other");
    Tally means, scales, rotations, opacities, colors, sh;
    const size_t strides[] = {a.sh_stride(), b.sh_stride()};
    for (size_t i = 0; i < a.size(); ++i) {
        for (size_t k = 0; k < 3; ++k) {
            means.add(a.world_mean(i)[int(k)], b.world_mean(i)[int(k)]);
            scales.add(a.log_scales[3 * i + k], b.log_scales[3 * i + k]);
            colors.add(a.sh[strides[0] * i + k] * shared::SH_C0, b.sh[strides[1] * i + k] * shared::SH_C0);
        }
        rotations.add(degrees_between(&a.quaternions[4 * i], &b.quaternions[4 * i]));
        opacities.add(sigmoid(a.opacity_logits[i]), sigmoid(b.opacity_logits[i]));
        for (size_t k = 3; k < std::max(strides[0], strides[1]); ++k)
            sh.add(k < strides[0] ? a.sh[strides[0] * i + k] : 0,
                   k < strides[1] ? b.sh[strides[1] * i + k] : 0);
    }
    return {means.named("position", "world units"), scales.named("scale", "of the logarithm"),
            rotations.named("rotation", "degrees"), opacities.named("opacity", "of 0..1"),
            colors.named("colour", "of 0..1"),      sh.named("SH above degree 0", "")};
}

}  // namespace ewa::cli
