// SPDX-License-Identifier: Apache-2.0
// A bounding volume hierarchy of two-child nodes, built by the surface area heuristic over bins (Wald 2007).
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
    std::array<FloatBox, 2> boxes;             // of a child that is none: low above high
    std::array<uint32_t, 2> references{0, 0};  // as layouts.h describes them
};

struct Hierarchy {
    std::vector<Node> nodes;      // the first is the root
    std::vector<uint32_t> order;  // leaves count triangles in this order: order[i] is the i-th's number
};

/// Boxes of finite numbers, one a triangle, at most 2^28 of them. No leaf has more than TRACE_LEAF_MAX, and
/// no way down more than TRACE_STACK nodes: where the heuristic would grow deeper, the halves are equal in
/// number instead.
Hierarchy build_hierarchy(std::span<const FloatBox> boxes);

}  // namespace ewa::pathtracer
