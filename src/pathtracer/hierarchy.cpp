// SPDX-License-Identifier: Apache-2.0
#include "pathtracer/hierarchy.h"

#include <algorithm>
#include <bit>
#include <glm/common.hpp>
#include <numeric>

namespace ewa::pathtracer {

namespace {

constexpr int kBins = 16;
constexpr float kNodeCost = 1.0f, kTriangleCost = 1.0f;  // of one visit each

void grow(FloatBox& box, const FloatBox& other) {
    box.low = glm::min(box.low, other.low);
    box.high = glm::max(box.high, other.high);
}

float half_area(const FloatBox& box) {
    const glm::vec3 d = glm::max(box.high - box.low, glm::vec3(0.0f));
    return d.x * d.y + d.y * d.z + d.z * d.x;
}

/// The depth of a tree whose nodes halve the number of triangles.
int halving_levels(uint32_t count) {
    return int(std::bit_width(count - 1));
}

struct Split {
    int axis = -1, bin = 0;  // bins up to this one go left
    float cost = 0;          // in visits, weighted by area
};

class Builder {
  public:
    explicit Builder(std::span<const FloatBox> boxes) : boxes_(boxes) {
        hierarchy_.order.resize(boxes.size());
        std::iota(hierarchy_.order.begin(), hierarchy_.order.end(), 0u);
    }

    Hierarchy build() {
        hierarchy_.nodes.emplace_back();
        struct Task {
            uint32_t node, first, count;
            int depth;
        };
        std::vector<Task> open;
        const auto attach = [&](uint32_t node, int child, uint32_t first, uint32_t count, int depth,
                                bool leaf) {
            if (count == 0) return;
            uint32_t reference = 0;
            if (leaf) {
                reference = shared::LEAF_FLAG | ((count - 1) << shared::LEAF_COUNT_SHIFT) | first;
            } else {
                reference = uint32_t(hierarchy_.nodes.size());
                hierarchy_.nodes.emplace_back();
                open.push_back({reference, first, count, depth});
            }
            hierarchy_.nodes[node].boxes[size_t(child)] = bounds(first, count);
            hierarchy_.nodes[node].references[size_t(child)] = reference;
        };
        const auto count = uint32_t(boxes_.size());
        if (count <= shared::TRACE_LEAF_MAX)
            attach(0, 0, 0, count, 0, true);
        else
            open.push_back({0, 0, count, 0});
        while (!open.empty()) {
            const Task task = open.back();
            open.pop_back();
            const uint32_t left = divide(task.first, task.count, task.depth);
            for (int child = 0; child < 2; ++child) {
                const uint32_t first = child == 0 ? task.first : task.first + left;
                const uint32_t n = child == 0 ? left : task.count - left;
                attach(task.node, child, first, n, task.depth + 1, is_leaf(first, n));
            }
        }
        return std::move(hierarchy_);
    }

  private:
    glm::vec3 center(uint32_t i) const {
        const FloatBox& box = boxes_[hierarchy_.order[i]];
        return 0.5f * box.low + 0.5f * box.high;
    }

    FloatBox bounds(uint32_t first, uint32_t count) const {
        FloatBox box;
        for (uint32_t i = first; i < first + count; ++i) grow(box, boxes_[hierarchy_.order[i]]);
        return box;
    }

    FloatBox center_bounds(uint32_t first, uint32_t count) const {
        FloatBox box;
        for (uint32_t i = first; i < first + count; ++i) grow(box, {center(i), center(i)});
        return box;
    }

    static int bin_of(float value, float low, float width) {
        return std::clamp(int((value - low) / width * float(kBins)), 0, kBins - 1);
    }

    Split best_split(uint32_t first, uint32_t count) const {
        const FloatBox centers = center_bounds(first, count);
        Split best;
        for (int axis = 0; axis < 3; ++axis) {
            const float low = centers.low[axis], width = centers.high[axis] - low;
            if (!(width > 0)) continue;
            std::array<FloatBox, kBins> boxes;
            std::array<uint32_t, kBins> counts{};
            for (uint32_t i = first; i < first + count; ++i) {
                const auto bin = size_t(bin_of(center(i)[axis], low, width));
                grow(boxes[bin], boxes_[hierarchy_.order[i]]);
                ++counts[bin];
            }
            std::array<float, kBins> right_costs{};
            FloatBox right;
            uint32_t on_right = 0;
            for (int bin = kBins - 1; bin > 0; --bin) {
                grow(right, boxes[size_t(bin)]);
                on_right += counts[size_t(bin)];
                right_costs[size_t(bin)] = half_area(right) * float(on_right);
            }
            FloatBox left;
            uint32_t on_left = 0;
            for (int bin = 0; bin + 1 < kBins; ++bin) {
                grow(left, boxes[size_t(bin)]);
                on_left += counts[size_t(bin)];
                if (on_left == 0 || on_left == count) continue;
                const float cost = half_area(left) * float(on_left) + right_costs[size_t(bin) + 1];
                if (best.axis < 0 || cost < best.cost) best = {axis, bin, cost};
            }
        }
        return best;
    }

    bool is_leaf(uint32_t first, uint32_t count) const {
        if (count <= 1) return true;
        if (count > shared::TRACE_LEAF_MAX) return false;
        const Split split = best_split(first, count);
        const float area = half_area(bounds(first, count));
        return split.axis < 0 ||
               kTriangleCost * float(count) * area <= kNodeCost * area + kTriangleCost * split.cost;
    }

    /// Reorders the triangles and returns how many go left: at least one, and not all.
    uint32_t divide(uint32_t first, uint32_t count, int depth) {
        const auto begin = hierarchy_.order.begin() + first, end = begin + count;
        // This node and the levels that its bisection needs would exceed the limit.
        const bool deep = depth + 1 + halving_levels(count) > int(shared::TRACE_STACK);
        if (const Split split = best_split(first, count); split.axis >= 0 && !deep) {
            const FloatBox centers = center_bounds(first, count);
            const float low = centers.low[split.axis], width = centers.high[split.axis] - low;
            const auto middle = std::partition(begin, end, [&](uint32_t i) {
                const float value = 0.5f * boxes_[i].low[split.axis] + 0.5f * boxes_[i].high[split.axis];
                return bin_of(value, low, width) <= split.bin;
            });
            return uint32_t(middle - begin);
        }
        int axis = 0;
        const FloatBox box = center_bounds(first, count);
        for (int i = 1; i < 3; ++i)
            if (box.high[i] - box.low[i] > box.high[axis] - box.low[axis]) axis = i;
        const auto middle = begin + count / 2;
        std::nth_element(begin, middle, end, [&](uint32_t a, uint32_t b) {
            const float x = boxes_[a].low[axis] + boxes_[a].high[axis],
                        y = boxes_[b].low[axis] + boxes_[b].high[axis];
            return x < y || (x == y && a < b);
        });
        return count / 2;
    }

    std::span<const FloatBox> boxes_;
    Hierarchy hierarchy_;
};

}  // namespace

Hierarchy build_hierarchy(std::span<const FloatBox> boxes) {
    return Builder(boxes).build();
}

}  // namespace ewa::pathtracer
