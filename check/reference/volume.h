// SPDX-License-Identifier: Apache-2.0
// Splats as a volume of Gaussians that emits and absorbs (Max 1995, "Optical Models for Direct Volume
// Rendering", eq. 9), without the approximations of splatting.
//
// Splat i has the density  rho_i(x) = k_i exp(-(x - mu)^T Sigma^-1 (x - mu) / 2)  and along a ray e + t d,
// |d| = 1, with
//   a = S^-1 R^T (e - mu),  b = S^-1 R^T d,
//   rho_i(t) = tau_i N(t; -a.b / b.b, 1 / |b|),   tau_i = tau0_i exp(-|a x b|^2 / (2 b.b))
// in closed form. The kernel says what k_i is:
// - Footprint::peak: 3DGS's opacity, the same from every side. The ray through the splat's centre always absorbs the
//   share `opacity`: tau0 = -ln(1 - opacity). So k_i depends on the ray's direction, and there is no density field.
// - Footprint::density: k_i is fixed, and a longer chord absorbs more: tau0 = softplus(logit) A / (s1 s2 s3 |b|).
//   s1 s2 s3 |b| is the splat's shadow: the product of the two standard deviations of its projection along d.
//   A = sqrt((s1^2 s2^2 + s2^2 s3^2 + s3^2 s1^2) / 3) is the shadow's root mean square over all directions. A sphere
//   looks the same with both kernels.
// A ray's colour is
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

/// What splatting does in place of the integral. Each can be switched on and off, so that its error can be measured.
/// Footprint::antialias is no approximation of the integral: its factor is not applied.
struct Approximations {
    bool overlap = false;  // each splat absorbs at one place: the one of a smaller distance is all in front
    bool order = false;    // that place is where the ray reaches the depth of the splat's centre
    bool formula =
        false;  // alpha = min(ALPHA_MAX, opacity G), with the optical depth tau0 G: 1 - exp(-tau0 G)
    bool affine = false;    // G is the 2D Gaussian of the projection's Taylor expansion
    bool low_pass = false;  // the splat is wider by LOW_PASS px^2 across the ray
    bool cut_off = false;   // no contribution below ALPHA_MIN, none behind TRANSMITTANCE_STOP
};

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
    Volume(const Values& values, const Camera& camera, const RenderOptions& options,
           const Approximations& approximations = {});

    /// The splats with an optical depth above `least` on the ray through (x, y), sorted by their middles.
    std::vector<RayGaussian> along(double x, double y, double least = 1e-7) const;

    /// The ray's colour by Gauss-Legendre quadrature between the splats' borders, relative error below 1e-6. With the
    /// approximations, if there are any.
    glm::dvec3 exact(double x, double y) const;

    /// The ray's colour by ray marching, with `samples` midpoints evenly from the nearest to the farthest splat.
    glm::dvec3 marched(double x, double y, int samples) const;

  private:
    static constexpr int kTile = 16;  // px
    struct Member {
        glm::dvec3 mean{0};      // relative to the eye
        glm::dmat3 whitener{0};  // of the rays' Gaussian: S^-1 R^T, or that of the wider splat
        double full_depth = 0;   // tau0; of a density times |b|
        double opacity = 0;      // of Approximations::formula
        double z = 0;            // view depth of the mean
        glm::dvec3 color{0};
        Projected footprint;  // of Approximations::affine
    };
    Member member_of(const Splat& splat, const Projected& projected, const ProjectionSteps& steps) const;
    void list(uint32_t member, const Projected& projected, double size);
    double near_along(double x, double y, glm::dvec3& direction) const;
    /// The optical depth of the whole ray. bb: |b|^2; gaussian: exp(-|a x b|^2 / (2 bb)).
    double optical_depth(const Member& member, double bb, double gaussian) const;
    glm::dvec3 composited(const std::vector<RayGaussian>& line) const;

    Camera camera_;
    glm::dvec3 background_{0};
    Footprint kernel_ = Footprint::peak;
    Approximations approximations_;
    std::vector<Member> members_;
    int columns_ = 0, rows_ = 0;
    std::vector<std::vector<uint32_t>> tiles_;  // the members that rays through the tile can meet
};

}  // namespace ewa::reference
