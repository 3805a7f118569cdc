// SPDX-License-Identifier: Apache-2.0
#include "scene/splat_shape.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>
#include <glm/matrix.hpp>
#include <limits>
#include <string>

#include "ewa/error.h"

namespace ewa::scene {

Decomposition decompose(glm::dmat3 a) {
    Decomposition result;
    constexpr int kSweeps = 30;
    for (int sweep = 0; sweep < kSweeps; ++sweep) {
        bool turned = false;
        for (int p = 0; p < 2; ++p)
            for (int q = p + 1; q < 3; ++q) {
                const double pq = glm::dot(a[p], a[q]), pp = glm::dot(a[p], a[p]), qq = glm::dot(a[q], a[q]);
                if (!(std::abs(pq) > 1e-16 * std::sqrt(pp * qq))) continue;
                turned = true;
                const double zeta = (qq - pp) / (2 * pq);
                const double t = (zeta >= 0 ? 1 : -1) / (std::abs(zeta) + std::hypot(1.0, zeta));
                const double c = 1 / std::hypot(1.0, t), s = c * t;
                const auto turn = [&](glm::dmat3& m) {
                    const glm::dvec3 old = m[p];
                    m[p] = c * old - s * m[q];
                    m[q] = s * old + c * m[q];
                };
                turn(a);
                turn(result.v);
            }
        if (!turned) break;
    }
    for (int i = 0; i < 3; ++i) {
        result.s[i] = glm::length(a[i]);
        result.u[i] = result.s[i] > 0 ? a[i] / result.s[i] : glm::dvec3(0);
    }
    return result;
}

glm::dmat3 right_handed(glm::dmat3 u) {
    for (int i = 0; i < 3; ++i) {
        if (glm::length(u[i]) > 0) continue;
        const glm::dvec3 other = u[(i + 1) % 3], third = u[(i + 2) % 3];
        if (glm::length(other) > 0 && glm::length(third) > 0) {
            u[i] = glm::cross(other, third);
            continue;
        }
        const glm::dvec3 from = glm::length(other) > 0 ? other : third;
        const glm::dvec3 away = std::abs(from.x) < 0.6 ? glm::dvec3(1, 0, 0) : glm::dvec3(0, 1, 0);
        const glm::dvec3 side = away - from * glm::dot(from, away);
        u[i] = glm::length(side) > 0 ? glm::normalize(side) : glm::dvec3(1, 0, 0);
    }
    if (glm::determinant(u) < 0) u[2] = -u[2];
    return u;
}

void check_transform(const glm::dmat4& matrix) {
    for (int column = 0; column < 4; ++column)
        for (int row = 0; row < 4; ++row)
            if (!std::isfinite(matrix[column][row]))
                throw InputError("the transform has an entry that is not finite");
    if (matrix[0][3] != 0 || matrix[1][3] != 0 || matrix[2][3] != 0 || matrix[3][3] != 1)
        throw InputError("the transform is not affine: its last row is not 0 0 0 1");
    const double determinant = glm::determinant(glm::dmat3(matrix));
    if (determinant == 0 || !std::isfinite(determinant))
        throw InputError("the transform flattens space: its determinant is " + std::to_string(determinant));
}

glm::dmat3 covariance_of(const Gaussians& g, size_t i) {
    const float* q = &g.quaternions[4 * i];
    const glm::dmat3 rotation(glm::normalize(glm::dquat(q[0], q[1], q[2], q[3])));
    glm::dmat3 axes = rotation;
    for (int k = 0; k < 3; ++k) axes[k] *= std::exp(double(g.log_scales[3 * i + size_t(k)]));
    return axes * glm::transpose(axes);
}

void set_covariance(Gaussians& g, size_t i, const glm::dmat3& covariance) {
    constexpr double kFlattest = 1e-12;  // of the longest axis, squared
    const Decomposition parts = decompose(covariance);
    const glm::dquat turn = glm::normalize(glm::quat_cast(right_handed(parts.u)));
    const double longest = std::max({parts.s.x, parts.s.y, parts.s.z});
    const double least = std::max(kFlattest * longest, std::numeric_limits<double>::min());
    float* q = &g.quaternions[4 * i];
    q[0] = float(turn.w), q[1] = float(turn.x), q[2] = float(turn.y), q[3] = float(turn.z);
    for (int axis = 0; axis < 3; ++axis)
        g.log_scales[3 * i + size_t(axis)] = float(std::log(std::max(parts.s[axis], least)) / 2);
}

}  // namespace ewa::scene
