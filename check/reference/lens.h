// SPDX-License-Identifier: Apache-2.0
// Where a lens shows a point, and how that changes with the point. A point p is in camera coordinates: x right, y down, z forward.
//   pinhole, brown   u = fx a' + cx with (a', b') = distort(x / z, y / z), v likewise
//   fisheye          u = fx d x / r + cx, v likewise; r = |(x, y)|, t = atan2(r, z), d = t + k1 t^3 + k2 t^5 + k3 t^7 + k4 t^9
//   equirectangular  u = fx atan2(x, z) + cx, v = fy atan2(y, |(x, z)|) + cy
//   orthographic     u = fx x + cx, v = fy y + cy
// src/scene/lens.h names the sources. J = d(u, v)/dp is the linearisation that projects the covariance. For a pinhole and brown,
// J is taken at tangents that clamp_slope clamps.
#pragma once
#include <array>
#include <glm/mat3x3.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include "ewa/camera.h"

namespace ewa::reference {

/// A 2 x 3 matrix by rows.
struct Rows {
    glm::dvec3 x{0}, y{0};
};

struct LensImage {
    bool shown =
        false;  // in front of the near plane, and where the lens is one to one; else the rest is not set
    double depth = 0;     // z, or for a fisheye and equirectangular images the distance; world units
    glm::dvec2 pixel{0};  // px
    Rows exact;           // d(pixel)/dp
    Rows jacobian;        // J
    /// The derivatives of the rows of J by p: hessian[i][j][k] = dJ_ij/dp_k. Not symmetric where a tangent is clamped.
    std::array<std::array<glm::dvec3, 3>, 2> hessian{};
    std::array<std::array<glm::dvec3, 3>, 2> exact_hessian{};  // of the rows of `exact`
};

LensImage lens_image(const Camera& camera, const glm::dvec3& point);

}  // namespace ewa::reference
