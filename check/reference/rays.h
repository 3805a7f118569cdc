// SPDX-License-Identifier: Apache-2.0
// Integration along each pixel's ray: Integrator::ray, fast_ray and march, with their gradients. volume.h defines what a
// splat is along a ray. Here t is the view depth: v is the ray's direction in camera coordinates with v.z = 1, or of length 1
// where the lens orders splats by their distance.
//
// With Footprint::antialias every splat is widened as by splatting's low-pass, and absorbs as much as before. With t0 the view depth
// of the mean m (from the eye) and f = sqrt(fx fy):
//   s'_k^2 = s_k^2 + w^2,  w^2 = LOW_PASS_ANTIALIAS (t0 / f)^2,  c = A(s) / A(s'),  A(s) = s1 s2 s3 |S^-1 R^T m|
//   depth  = -ln(1 - c opacity)            of the ray through the mean
// c is the share of the wider splat's shadow. Mip-Splatting (Yu et al. 2024) scales opacity by the same share, on the image.
// With p = R^T m, Q = sum (p_k / s_k)^2, and G the gradient by ln(c opacity), the splat's own scales, rotation and mean get
//   dL/d(ln s_k) = (s_k / s'_k)^2 D_k + G (1 - (p_k / s_k)^2 / Q),  D_k = dL/d(ln s'_k) + G ((p_k / s'_k)^2 / Q' - 1)
//   dL/d(ln w) = sum (w / s'_k)^2 D_k,  torque e x p,  dL/dm = R e,  e_k = G p_k (1 / (s_k^2 Q) - 1 / (s'_k^2 Q'))
//
// ray, fast_ray: splats are ordered by their middles on the ray, or by the view depths of their means. alpha = min(ALPHA_MAX, 1 - exp(-depth)), with the cut-off and the stop
// of splatting. A middle in front of NEAR_PLANE does not count.
// march: the optical depth d_ij of splat i in interval j of the ray, in closed form. All splats are mixed in an interval:
//   C = sum_j T_j (1 - exp(-d_j)) / d_j sum_i c_i d_ij + T background,  d_j = sum_i d_ij,  T_j = exp(-d_0 - ... - d_{j-1})
// shaders/lib/march.glsl says where intervals begin and end. The gradient holds these borders fixed.
//
// With G = dL/d(ln depth), and at border j with y = (t_j - middle) |b|:  S1 = sum (D_{j-1} - D_j) phi(y),
// S2 = sum (D_{j-1} - D_j) phi(y) y,  D_j = depth dL/d(d_ij),  a splat's gradient is made of sums over its rays:
//   W = -G x x^T + S1 (b x^T + x b^T) + (S2 - share G) b b^T,  V = -G x + S1 b,  with b of length 1 and share 1 for densities
//   dL/d(mean) = -M^T V,  dL/d(ln s_k) = -W_kk,  torque about axis k = (s_j / s_i - s_i / s_j) W_ij,  (i, j, k) cyclic
// x is the ray's point closest to the mean, whitened: W = dL/dM M^-1, V = dL/da.
#pragma once
#include <optional>
#include <vector>

#include "ewa/camera.h"
#include "ewa/render_options.h"
#include "reference/blend.h"
#include "reference/projection.h"
#include "reference/values.h"

namespace ewa::reference {

/// The visible splats of a camera, prepared for integration along its rays.
class Rays {
  public:
    /// fixed: the rays whose intervals a march takes over, for differences; null: its own.
    Rays(const Values& values, const Camera& camera, const RenderOptions& options,
         const Smoothing& smoothing = {}, const Rays* fixed = nullptr);

    const std::vector<Projected>& projected() const { return projected_; }  // per splat
    /// evaluated stays 0.
    Blended blended() const;
    /// dL/d(stored value), from dL/d(RGB) of each pixel.
    Values gradient(const Raster& image_gradient) const;
    /// Per pixel: whether a decision of the model (cut-off, clamp, stop, order, near plane) is within a relative distance of
    /// its threshold.
    std::vector<uint8_t> at_threshold(double relative) const;

  private:
    struct Widening {
        glm::dvec3 own{0};     // scales, before
        glm::dvec3 mean{0};    // p: from the eye, along the splat's axes
        glm::dvec3 deeper{0};  // d(t0)/d(mean), in world coordinates
        double depth = 0;      // t0
        double squared = 0;    // w^2
        double opacity = 0;    // c opacity
    };
    struct Member {
        uint32_t splat = 0;
        glm::dvec3 a{0};         // from the mean to the eye, whitened
        glm::dmat3 whitener{0};  // S^-1 R^T
        double full_depth = 0;   // of a density: times |b| / |v|
        glm::dvec3 scale{0};     // with Footprint::antialias of the wider splat
        glm::dvec3 color{0};
        Widening widening;  // with Footprint::antialias
    };
    /// A splat on one ray.
    struct Met {
        size_t member = 0;
        double depth = 0, middle = 0, sharpness = 0;  // sharpness: |b|
        glm::dvec3 across{0}, along{0};               // x, and b of length 1
    };
    struct Sums {
        glm::dmat3 w{0};
        glm::dvec3 v{0}, color{0};
        double depth = 0;  // dL/d(ln depth)
    };
    std::vector<Met> met(int x, int y, double least) const;
    std::vector<Met> met_in_order(int x, int y) const;
    std::vector<double> borders(int x, int y) const;
    void add(Sums& sums, const Met& met, double g, double s1, double s2) const;
    /// Calls visit(Met, Alpha, transmittance before it) front to back. Returns the transmittance behind the last.
    template <class Visit>
    double walk(int x, int y, Visit visit) const;
    /// Calls visit(interval, depth, emitted, transmittance before it). Returns the transmittance behind the last.
    template <class Visit>
    double march(const std::vector<Met>& line, const std::vector<double>& borders, Visit visit) const;
    void ray_gradient(int x, int y, const glm::dvec3& up, std::vector<Sums>& sums) const;
    void march_gradient(int x, int y, const glm::dvec3& up, std::vector<Sums>& sums) const;
    Splat splat_gradient(const Member& member, const Sums& sums) const;
    void widen(Member& member, const Splat& splat, const glm::dmat3& axes, const glm::dvec3& mean) const;
    /// From the gradient of the wider splat to that of the splat. by_opacity: dL/d(ln(c opacity)).
    void narrow(const Member& member, const glm::dmat3& axes, double by_opacity, Splat& gradient,
                glm::dvec3& torque) const;
    /// v, and nothing where the lens shows nothing.
    std::optional<glm::dvec3> view_of(int x, int y) const;

    Values values_;
    Camera camera_;
    RenderOptions options_;
    Smoothing smoothing_;
    const Rays* fixed_;
    bool by_distance_;   // of the lens
    double lens_limit_;  // of the lens
    std::vector<Projected> projected_;
    std::vector<Member> members_;
};

}  // namespace ewa::reference
