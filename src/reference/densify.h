// SPDX-License-Identifier: Apache-2.0
// Adaptive density control (Kerbl et al. 2023, section 5.2, and its published code, scene/gaussian_model.py:
// add_densification_stats, densify_and_clone, densify_and_split, densify_and_prune, reset_opacity).
//
// A splat grows where the mean over views of |dL/d(mean in normalised device coordinates)| reaches the
// threshold: it is cloned where its largest scale is at most split_scale * extent, else split in two. A splat
// is pruned where its opacity is below prune_opacity, or, once opacity has been reset, its largest scale is
// above prune_scale * extent; as the published code prunes after it grows, a split's children are held to the
// same with their smaller scales.
#pragma once
#include <cstdint>
#include <glm/vec3.hpp>
#include <span>
#include <vector>

#include "ewa/camera.h"
#include "reference/blend_backward.h"
#include "reference/values.h"

namespace ewa::reference {

struct DensifyStatistics {
    std::vector<double>
        gradient_sum;             // of the norm, in normalised device coordinates (width and height are 2)
    std::vector<uint32_t> views;  // in which the splat had a tile
    explicit DensifyStatistics(size_t n = 0) : gradient_sum(n, 0.0), views(n, 0u) {}
};

/// in_view: one flag a splat, whether it had a tile. A pixel is 2/width of the device coordinates: the
/// gradient is (x * width / 2, y * height / 2). absolute: of the pixels' absolute gradients.
void accumulate(DensifyStatistics& statistics, std::span<const ScreenGradient> gradients,
                std::span<const uint8_t> in_view, const Camera& camera, bool absolute = false);

struct DensifyOptions {
    double extent = 1;  // of the scene, world units
    double grow_gradient = 2e-4;
    double split_scale = 0.01;  // share of extent
    double prune_opacity = 0.005;
    double prune_scale = 0.1;  // share of extent
    bool prune_large = false;  // true once opacity has been reset
    uint64_t max_splats = UINT64_MAX;
};

enum class Decision : uint8_t { keep, clone, split, prune };

/// mean_gradient: gradient_sum / views, 0 for a splat that was never in view.
Decision decide(const Splat& splat, double mean_gradient, const DensifyOptions& options);

/// For all splats; where growth would pass max_splats, the clones and splits that come last by index are kept
/// as they are (each adds one; what is pruned makes room first).
std::vector<Decision> decide(const Values& values, const DensifyStatistics& statistics,
                             const DensifyOptions& options);

/// A split's child: mean + R (scale * normal), scales divided by SPLIT_SCALE, all else the parent's. normal:
/// three independent standard normal numbers. revised_opacity: the child's is 1 - (1 - opacity)^(1/2) (Rota
/// Bulo et al. 2024, "Revising densification", eq. 9).
Splat split_child(const Splat& parent, const glm::dvec3& normal, bool revised_opacity = false);

struct Densified {
    Values values;  // what stays in index order, then the clones, then the children pair by pair
    std::vector<uint32_t> source;  // the old index of each
    std::vector<uint8_t> fresh;    // 1 for clones' copies and children: their optimiser moments start at zero
};

/// normals: two for each split, in index order.
Densified densify(const Values& values, std::span<const Decision> decisions,
                  std::span<const glm::dvec3> normals);

/// logit <- min(logit, logit of ceiling); 3DGS uses 0.01. The opacities' optimiser moments start again at
/// zero.
void reset_opacity(Values& values, double ceiling);

}  // namespace ewa::reference
