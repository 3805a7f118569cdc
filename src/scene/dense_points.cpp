// SPDX-License-Identifier: Apache-2.0
#include "scene/dense_points.h"

#include <algorithm>
#include <glm/geometric.hpp>

#include "scene/statistics.h"

namespace ewa::scene {
namespace {

constexpr size_t kPartners = 2;

}  // namespace

PointCloud with_midpoints(const PointCloud& points, size_t most,
                          const std::function<bool(const glm::dvec3&)>& wanted) {
    PointCloud dense = points;
    if (points.positions.size() >= most) return dense;
    std::vector<std::array<size_t, 2>> pairs = neighbor_pairs(points.positions, kPartners);
    const auto middle = [&](const std::array<size_t, 2>& pair) {
        return 0.5 * (points.positions[pair[0]] + points.positions[pair[1]]);
    };
    if (wanted) std::erase_if(pairs, [&](const auto& pair) { return !wanted(middle(pair)); });
    const size_t room = most - points.positions.size();
    if (pairs.size() > room) {
        const auto longer = [&](const std::array<size_t, 2>& a, const std::array<size_t, 2>& b) {
            const glm::dvec3 along_a = points.positions[a[1]] - points.positions[a[0]],
                             along_b = points.positions[b[1]] - points.positions[b[0]];
            const double length_a = glm::dot(along_a, along_a), length_b = glm::dot(along_b, along_b);
            return length_a != length_b ? length_a > length_b : a < b;
        };
        std::sort(pairs.begin(), pairs.end(), longer);
        pairs.resize(room);
    }
    for (const std::array<size_t, 2>& pair : pairs) {
        const auto [a, b] = pair;
        dense.positions.push_back(middle(pair));
        std::array<uint8_t, 3> color;
        for (size_t c = 0; c < 3; ++c)
            color[c] = uint8_t((int(points.colors[a][c]) + int(points.colors[b][c])) / 2);
        dense.colors.push_back(color);
    }
    return dense;
}

}  // namespace ewa::scene
