// SPDX-License-Identifier: Apache-2.0
// The changes that training makes to splats: Adam, and the strategies that add, move and remove splats.
#pragma once
#include <cstdint>
#include <glm/vec3.hpp>
#include <limits>
#include <span>
#include <vector>

#include "ewa/camera.h"
#include "reference/blend.h"
#include "reference/values.h"

namespace ewa::reference {

// Adam (Kingma and Ba 2015, algorithm 1) in the form of PyTorch and 3DGS:
//   m <- BETA1 m + (1 - BETA1) g,  v <- BETA2 v + (1 - BETA2) g^2
//   x <- x - rate (m / (1 - BETA1^t)) / (sqrt(v / (1 - BETA2^t)) + EPSILON),  t = 1, 2, ...
// As in 3DGS, a value of a splat that this step does not see is updated with g = 0.

struct AdamState {
    std::vector<double> m, v;  // per value, initially zero
    explicit AdamState(size_t n = 0) : m(n, 0.0), v(n, 0.0) {}
};

// With Nesterov's momentum (Dozat 2016, "Incorporating Nesterov momentum into Adam", algorithm 2 with a constant BETA1), the
// step takes BETA1 m / (1 - BETA1^(t + 1)) + (1 - BETA1) g / (1 - BETA1^t) in place of m / (1 - BETA1^t).

/// `step` counts from 1. A value whose new m, v or x is not finite keeps all three; returns how many do.
uint64_t adam_step(std::span<double> values, std::span<const double> gradient, AdamState& state, double rate,
                   int step, bool nesterov = false);

// Both moments in a word, 16 bits each (docs/numerics.md, "Moments in 16 bits").

struct AdamMoments {
    double first = 0, second = 0;
};
/// first, and second >= 0: float32 values. random: its low 16 bits round the first moment, its high 14 bits the second.
uint32_t packed_moments(double first, double second, uint32_t random);
AdamMoments unpacked_moments(uint32_t word);

// ADC (Kerbl et al. 2023, section 5.2, and its published code, scene/gaussian_model.py:
// add_densification_stats, densify_and_clone, densify_and_split, densify_and_prune, reset_opacity):
// - A splat grows if the mean over views of |dL/d(mean in device coordinates)| reaches the threshold.
// - It is cloned if its largest scale is at most split_scale * extent, else split in two.
// - It is pruned if its opacity is below prune_opacity.
// - Once opacity has been reset, it is also pruned if its largest scale is above prune_scale * extent.
// - It is pruned, whatever its gradient, if its largest scale is above its distance to every point of the cameras' ball.
// - The published code prunes after it grows, so this applies to a split's children with smaller scales.
//
// MCMC (Kheradmand et al. 2024): values of a splat that several share, choice of sources, noise of the means.

struct DensifyStatistics {
    /// Sums of the norm, in normalised device coordinates (width and height are 2).
    std::vector<double> gradient_sum;
    std::vector<uint32_t> views;  // number of views in which the splat had a tile
    explicit DensifyStatistics(size_t n = 0) : gradient_sum(n, 0.0), views(n, 0u) {}
};

/// in_view has one flag per splat, whether it had a tile. A pixel is 2/width in device coordinates, so the
/// gradient is (x * width / 2, y * height / 2). `absolute` uses the sums of the pixels' absolute gradients.
void accumulate(DensifyStatistics& statistics, std::span<const ScreenGradient> gradients,
                std::span<const uint8_t> in_view, const Camera& camera, bool absolute = false);

/// A box, world units. Usually everything.
struct Region {
    glm::dvec3 low{-std::numeric_limits<double>::infinity()}, high{std::numeric_limits<double>::infinity()};

    bool contains(const glm::dvec3& point) const;
};

/// A ball that has all cameras in it. Usually without end.
struct CameraBall {
    glm::dvec3 middle{0};
    double radius = std::numeric_limits<double>::infinity();
};

struct DensifyOptions {
    double extent = 1;  // of the scene, world units
    double grow_gradient = 2e-4;
    double split_scale = 0.01;  // share of extent
    double prune_opacity = 0.005;
    double prune_scale = 0.1;  // share of extent
    bool prune_large = false;  // true once opacity has been reset
    Region region{};           // that splats grow in
    CameraBall ball{};
    uint64_t max_splats = UINT64_MAX;
};

enum class Decision : uint8_t { keep, clone, split, prune };

/// mean_gradient is gradient_sum / views, or 0 for a splat that was never in view.
Decision decide(const Splat& splat, double mean_gradient, const DensifyOptions& options);

/// Decides for all splats. A clone or split adds one splat, and pruned splats are subtracted first. If growth
/// exceeds max_splats, the clones and splits with the highest indices become `keep`.
std::vector<Decision> decide(const Values& values, const DensifyStatistics& statistics,
                             const DensifyOptions& options);

/// A split's child: mean + R (scale * normal), scales divided by SPLIT_SCALE, and the parent's other values.
/// `normal` has three independent standard normal numbers.
Splat split_child(const Splat& parent, const glm::dvec3& normal);

/// The splat with opacity 1 - (1 - opacity)^share: 1 / share of them in one place let through as much as it.
Splat thinned(Splat splat, double share);
/// A child of an even split: EVEN_OFFSET standard deviations along the longest axis of the parent, forward or back, and EVEN_SCALE times
/// as long there. Two of them have the parent's second moment and optical thickness. The first of equal axes counts as the longest.
Splat even_child(const Splat& parent, bool forward);

struct Densified {
    Values values;  // kept splats in index order, then the clones, then the children pair by pair
    std::vector<uint32_t> source;  // the old index of each
    std::vector<uint8_t> fresh;    // 1 for copies and children, whose optimiser moments start at zero
};

/// `normals` has two entries for each split, in index order.
Densified densify(const Values& values, std::span<const Decision> decisions,
                  std::span<const glm::dvec3> normals);

/// logit <- min(logit, logit of ceiling). 3DGS uses 0.01. Adam's moments of the opacities restart at zero.
void reset_opacity(Values& values, double ceiling);

/// Eq. 9: the values of each of N splats that replace one of opacity o: opacity 1 - (1 - o)^(1/N) and the
/// factor of the scales. Up to N = 20, it is the paper's double sum (exact to 1e-9); beyond, an integral.
struct Share {
    double opacity = 0, scale_factor = 1;
};
Share share_of(double opacity, int parts);

/// The source of each draw: floor(random * total / 2^32) is in its interval of the cumulative weights.
std::vector<uint32_t> draw_sources(std::span<const uint32_t> weights, std::span<const uint32_t> random);

/// The mean of a source or a copy, moved by `spread` standard deviations times a normal draw. World units.
glm::dvec3 apart(const Splat& source, const glm::dvec3& normal, double spread);

/// Eq. 8: amplitude * sigmoid(-MCMC_GATE_SLOPE (opacity - MCMC_GATE_OPACITY)) * Sigma * normal, world units.
glm::dvec3 noise(const Splat& splat, const glm::dvec3& normal, double amplitude);

}  // namespace ewa::reference
