// SPDX-License-Identifier: Apache-2.0
// A tree of boxes over a scene of splats, for formats with levels of detail.
#pragma once
#include <cstddef>
#include <cstdint>
#include <glm/common.hpp>
#include <glm/vec3.hpp>
#include <limits>
#include <span>
#include <vector>

#include "ewa/gaussians.h"

namespace ewa::io {

struct Bound {
    glm::dvec3 low{std::numeric_limits<double>::infinity()}, high{-std::numeric_limits<double>::infinity()};

    void add(const glm::dvec3& from, const glm::dvec3& to) {
        low = glm::min(low, from);
        high = glm::max(high, to);
    }
    void add(const Bound& other) { add(other.low, other.high); }
};

/// The axis-aligned box (world) of the splat's ellipsoid at this number of standard deviations.
Bound bound_of_splat(const Gaussians& gaussians, size_t i, double deviations = 1);

struct TreeNode {
    int axis = -1;  // of an inner node: its first child has what is below the plane
    float plane = 0;
    size_t first = 0, second = 0;  // children; both come after their parent
};

/// When a node is divided.
struct TreeLimits {
    size_t most = 0;     // splats of a leaf
    double longest = 0;  // a leaf with a longer side is divided too, world units; 0: never for that
    size_t few = 0;      // unless it has at most so many splats
    int depth = 64;      // of the deepest leaf; the root has 0
};

/// Builds the tree. Planes pass through the medians of the splats' means, and divide all of space: every point is in a leaf.
/// The first node is the root.
std::vector<TreeNode> build_tree(const Gaussians& gaussians, const TreeLimits& limits);

/// The node at this depth whose box has the mean, or the leaf above it. mean: three coordinates.
size_t node_of(const std::vector<TreeNode>& nodes, const float* mean, int depth = 64);

}  // namespace ewa::io
