// SPDX-License-Identifier: Apache-2.0
#include "reference/motion.h"

#include <cmath>
#include <glm/geometric.hpp>

namespace ewa::reference {

CameraMotion motion_backward(const CameraMotion& motion, const CameraMotion& gradient) {
    const glm::dvec3 w = motion.rotation;
    const double angle = glm::length(w);
    if (angle == 0) return gradient;
    const glm::dvec3 axis = w / angle;
    const double sine = std::sin(angle), cosine = std::cos(angle);
    // The transposes of exp(w), and of its left Jacobian (Sola et al. 2018, eq. 145), by Rodrigues' formula.
    const auto transposed = [&](double along, double across, double turned, const glm::dvec3& v) {
        return across * v + (along - across) * axis * glm::dot(axis, v) - turned * glm::cross(axis, v);
    };
    CameraMotion out = gradient;
    out.rotation = transposed(1, sine / angle, (1 - cosine) / angle, gradient.rotation);
    out.shift = transposed(1, cosine, sine, gradient.shift);
    return out;
}

}  // namespace ewa::reference
