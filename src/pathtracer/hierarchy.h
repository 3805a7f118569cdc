// SPDX-License-Identifier: Apache-2.0
// A bounding volume hierarchy of two-child nodes, built by the binned surface area heuristic (Wald 2007).
#pragma once
#include <array>
#include <cstdint>
#include <glm/vec3.hpp>
#include <span>
#include <vector>

#include "shared/constants.h"
#include "shared/layouts.h"

namespace ewa::pathtracer {

struct FloatBox {
    glm::vec3 low{3e38f}, high{-3e38f};
};

struct Node {
    std::array<FloatBox, 2> boxes;             // low above high for a missing child
    std::array<uint32_t, 2> references{0, 0};  // see layouts.h
};

struct Hierarchy {
    std::vector<Node> nodes;  // the first is the root
    /// Leaves refer to sorted indices. order[i] is the triangle at sorted index i.
    std::vector<uint32_t> order;
};

/// `boxes` are the finite bounds of at most 2^28 triangles. A leaf has at most TRACE_LEAF_MAX triangles, and
/// a path from the root at most TRACE_STACK nodes. Where the heuristic would exceed that depth, nodes split
/// into equal counts.
Hierarchy build_hierarchy(std::span<const FloatBox> boxes);

}  // namespace ewa::pathtracer
