// SPDX-License-Identifier: Apache-2.0
#include "io/splats/splat_tree.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "scene/splat_arrays.h"
#include "scene/splat_shape.h"

namespace ewa::io {

namespace {

class TreeBuilder {
  public:
    TreeBuilder(const Gaussians& gaussians, const TreeLimits& limits) : g_(gaussians), limits_(limits) {}

    std::vector<TreeNode> build() {
        std::vector<uint32_t> all(g_.size());
        std::iota(all.begin(), all.end(), 0u);
        add(all, 0);
        return std::move(nodes_);
    }

  private:
    float place(uint32_t i, int axis) const { return g_.means[3 * size_t(i) + size_t(axis)]; }

    size_t add(std::span<uint32_t> splats, int depth) {
        const size_t index = nodes_.size();
        nodes_.emplace_back();
        Bound box;
        for (const uint32_t i : splats) {
            const glm::dvec3 mean(place(i, 0), place(i, 1), place(i, 2));
            box.add(mean, mean);
        }
        const glm::dvec3 sides = box.high - box.low;
        int axis = 0;
        for (int k = 1; k < 3; ++k)
            if (sides[k] > sides[axis]) axis = k;
        const bool long_side =
            limits_.longest > 0 && sides[axis] > limits_.longest && splats.size() > limits_.few;
        const bool split = splats.size() > limits_.most || long_side;
        if (!split || !(sides[axis] > 0) || depth == limits_.depth) return index;
        const auto middle = splats.begin() + std::ptrdiff_t(splats.size() / 2);
        std::nth_element(splats.begin(), middle, splats.end(),
                         [&](uint32_t a, uint32_t b) { return place(a, axis) < place(b, axis); });
        float plane = place(*middle, axis);
        if (plane == float(box.low[axis])) {  // nothing is below it: the next place divides
            plane = std::numeric_limits<float>::infinity();
            for (const uint32_t i : splats)
                if (place(i, axis) > float(box.low[axis])) plane = std::min(plane, place(i, axis));
        }
        // The planes and the boxes are the same however nth_element leaves the splats.
        const auto second =
            std::partition(splats.begin(), splats.end(), [&](uint32_t i) { return place(i, axis) < plane; });
        const size_t below = size_t(second - splats.begin());
        const size_t left = add(splats.subspan(0, below), depth + 1),
                     right = add(splats.subspan(below), depth + 1);
        nodes_[index] = {axis, plane, left, right};
        return index;
    }

    const Gaussians& g_;
    const TreeLimits& limits_;
    std::vector<TreeNode> nodes_;
};

}  // namespace

Bound bound_of_splat(const Gaussians& gaussians, size_t i, double deviations) {
    const glm::dmat3 c = scene::covariance_of(gaussians, i);
    const glm::dvec3 mean = gaussians.world_mean(i),
                     reach(std::sqrt(c[0][0]), std::sqrt(c[1][1]), std::sqrt(c[2][2]));
    return {mean - deviations * reach, mean + deviations * reach};
}

std::vector<TreeNode> build_tree(const Gaussians& gaussians, const TreeLimits& limits) {
    return TreeBuilder(gaussians, limits).build();
}

size_t node_of(const std::vector<TreeNode>& nodes, const float* mean, int depth) {
    size_t at = 0;
    for (; depth > 0 && nodes[at].axis >= 0; --depth)
        at = mean[nodes[at].axis] < nodes[at].plane ? nodes[at].first : nodes[at].second;
    return at;
}

}  // namespace ewa::io
