// SPDX-License-Identifier: Apache-2.0
// Splats as a volume of Gaussians that emits and absorbs (Max 1995, "Optical Models for Direct Volume
// Rendering", eq. 9), without the approximations of splatting.
//
// Splat i has the density  rho_i(x) = k_i exp(-(x - mu)^T Sigma^-1 (x - mu) / 2)  and along a ray e + t d,
// |d| = 1, with
//   a = S^-1 R^T (e - mu),  b = S^-1 R^T d,
//   rho_i(t) = tau_i N(t; -a.b / b.b, 1 / |b|),   tau_i = tau0_i exp(-|a x b|^2 / (2 b.b))
// in closed form. k_i depends on the ray's direction, so that the ray through the splat's centre always
// absorbs the share `opacity`: tau0 = -ln(1 - opacity), as in 3DGS. A ray's colour is
//   C = integral_near^inf sum_i c_i rho_i(t) T(t) dt + T(inf) background,
//   T(t) = exp(-sum_i tau_i (Phi((t - t_i) / s_i) - Phi((near - t_i) / s_i)))
// with the colours of splatting (SH towards the mean). Here splats interpenetrate. Splatting flattens them at
// the depth of their centres, widens them by a low-pass and cuts them at 1/255.
#pragma once
#include <cstdint>
#include <glm/mat3x3.hpp>
#include <glm/vec3.hpp>
#include <vector>

#include "ewa/camera.h"
#include "ewa/render_options.h"
#include "reference/projection.h"
#include "reference/values.h"

namespace ewa::reference {

/// A splat on one ray.
struct RayGaussian {
    double depth = 0;   // optical depth along the whole ray
    double middle = 0;  // distance from the eye (world units)
    double sigma = 0;   // world units
    glm::dvec3 color{0};
};

/// The visible splats of a camera, prepared for its rays. x and y are in px from the top left corner.
class Volume {
  public:
    Volume(const Values& values, const Camera& camera, const RenderOptions& options);

    /// The splats with an optical depth above `least` on the ray through (x, y), sorted by their middles.
    std::vector<RayGaussian> along(double x, double y, double least = 1e-7) const;

    /// The ray's colour by Gauss-Legendre quadrature between the splats' borders, relative error below 1e-6.
    glm::dvec3 exact(double x, double y) const;

    /// The same by ray marching, with `samples` midpoints evenly from the nearest to the farthest splat.
    glm::dvec3 marched(double x, double y, int samples) const;

  private:
    static constexpr int kTile = 16;  // px
    struct Member {
        glm::dvec3 mean{0};      // relative to the eye
        glm::dmat3 whitener{0};  // S^-1 R^T
        double full_depth = 0;   // tau0
        glm::dvec3 color{0};
    };
    void list(uint32_t member, const Projected& projected, double size);
    double near_along(double x, double y, glm::dvec3& direction) const;

    Camera camera_;
    glm::dvec3 background_{0};
    std::vector<Member> members_;
    int columns_ = 0, rows_ = 0;
    std::vector<std::vector<uint32_t>> tiles_;  // the members that rays through the tile can meet
};

}  // namespace ewa::reference
