// SPDX-License-Identifier: Apache-2.0
#include "mesh/protocol.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/common.hpp>
#include <map>
#include <utility>

#include "core/text.h"
#include "ewa/error.h"

namespace ewa::mesh {

Protocol protocol_named(const std::string& name) {
    if (name == "dtu") return {.spacing = 0.2, .farthest = 20};
    static const std::map<std::string, double> thresholds{
        {"Barn", 0.01},      {"Caterpillar", 0.005}, {"Church", 0.025}, {"Courthouse", 0.025},
        {"Ignatius", 0.003}, {"Meetingroom", 0.01},  {"Truck", 0.005}};
    const std::string family = "tanks-and-temples:";
    if (name.starts_with(family))
        if (const auto found = thresholds.find(name.substr(family.size())); found != thresholds.end())
            return {.spacing = found->second / 2, .threshold = found->second, .cell = found->second / 2};
    std::string scenes;
    for (const auto& [scene, threshold] : thresholds) scenes += (scenes.empty() ? "" : ", ") + scene;
    throw InputError("--protocol: '" + core::one_line(name) + "' is neither dtu nor " + family +
                     "SCENE with a scene of " + scenes);
}

size_t points_at(const Surface& mesh, double spacing) {
    constexpr double kMost = 1e7;
    const double points = std::ceil(mesh.area() / (spacing * spacing));
    if (!(points <= kMost))
        throw InputError(
            fmt::format("--protocol: {:.3g} points at {:g} from each other would lie on the mesh; its "
                        "unit is another than the protocol's",
                        points, spacing));
    return size_t(std::max(1.0, points));
}

std::vector<glm::dvec3> thinned(const std::vector<glm::dvec3>& points, double cell) {
    std::vector<std::pair<std::array<double, 3>, size_t>> placed;  // cube and point
    placed.reserve(points.size());
    for (size_t i = 0; i < points.size(); ++i) {
        const glm::dvec3 cube = glm::floor(points[i] / cell);
        placed.push_back({{cube.x, cube.y, cube.z}, i});
    }
    std::ranges::sort(placed);
    std::vector<glm::dvec3> means;
    for (size_t i = 0; i < placed.size();) {
        glm::dvec3 sum(0);
        const size_t first = i;
        for (; i < placed.size() && placed[i].first == placed[first].first; ++i)
            sum += points[placed[i].second];
        means.push_back(sum / double(i - first));
    }
    return means;
}

}  // namespace ewa::mesh
