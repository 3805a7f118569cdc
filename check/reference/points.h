// SPDX-License-Identifier: Apache-2.0
// Splats drawn as spheres (RenderOptions::points), as PyTorch3D draws point clouds (Ravi et al. 2020, PointsRasterizer and
// AlphaCompositor):
//   s        = exp(mean of the log scales)                         world units
//   radius.x = ELLIPSOID_REACH sqrt((fx s / z)^2 + LOW_PASS)       px; likewise y
//   q        = ((x - mean2d.x) / radius.x)^2 + ((y - mean2d.y) / radius.y)^2
//   alpha    = min(ALPHA_MAX, 1 - q) where q < 1
// A pixel blends the nearest spheres that cover it, by the depth of the centre, and no others. It ends after the sphere that
// takes T to TRANSMITTANCE_STOP. The opacity and the rotation
// are not used. The backward pass has dalpha/dmean2d.x = 2 (x - mean2d.x) / radius.x^2, dalpha/d(ln radius.x) = 2 u^2 with
// u = (x - mean2d.x) / radius.x, and dln radius.x/dln s = (fx s / z)^2 / ((fx s / z)^2 + LOW_PASS) = -dln radius.x/dln z.
#pragma once
#include "ewa/camera.h"
#include "ewa/image.h"
#include "ewa/render_options.h"
#include "reference/rendered.h"
#include "reference/values.h"

namespace ewa::reference {

/// The same as render() and loss_gradient(), which call these. Rendered::instances has no entries, and
/// neither has ReferenceGradient::blend::instances.
Rendered render_points(const Values& values, const Camera& camera, const RenderOptions& options);
ReferenceGradient points_loss_gradient(const Values& values, const Camera& camera, const Image& target,
                                       const RenderOptions& options, const LossWeights& weights = {});

}  // namespace ewa::reference
