// SPDX-License-Identifier: Apache-2.0
// The surface that a splat stands for, and images of it.
//
// With Sigma = R S S R^T and the direction of sight v at the mean, the density along rays parallel to v is highest on the plane
// through the mean with normal Sigma^-1 v. With the depth h . p of a point p in camera axes, s = J W Sigma W^T h, and the
// covariance Sigma2 of the footprint, the depth of that plane at a pixel is
//   z + s . Sigma2^-1 d,  d = pixel centre - mean2d
// This is the mean of the depth where the position in the image is known to within the low-pass. It deviates from z by at most
// the splat's standard deviation along h times the deviation of the pixel.
#pragma once
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <span>
#include <vector>

#include "reference/rendered.h"
#include "reference/values.h"

namespace ewa::reference {

struct Surface {
    glm::dvec3 normal{0};  // world axes, towards the eye, of length 1
    glm::dvec2 slope{0};   // of the depth, world units a px
};

/// One per splat; zero where it is not visible.
std::vector<Surface> surfaces(const Values& values, const Camera& camera, const RenderOptions& options);

/// Depth of the splat whose contribution takes the transmittance to MEDIAN_TRANSMITTANCE or below, at least NEAR_PLANE. 0 where none
/// does.
Raster median_depth(const Rendered& rendered, std::span<const Surface> surfaces,
                    const Smoothing& smoothing = {});

/// sum n alpha T, divided by its length where that is not 0.
Raster normals(const Rendered& rendered, std::span<const Surface> surfaces, const Smoothing& smoothing = {});

}  // namespace ewa::reference
