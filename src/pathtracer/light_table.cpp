// SPDX-License-Identifier: Apache-2.0
#include "pathtracer/light_table.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <glm/geometric.hpp>
#include <numbers>
#include <numeric>

namespace ewa::pathtracer {

namespace {

uint32_t word(double value) {
    return std::bit_cast<uint32_t>(float(value));
}

double mean(const glm::dvec3& v) {
    return (v.r + v.g + v.b) / 3;
}

struct Entry {
    std::array<uint32_t, 4 * shared::LIGHT_TEXELS> words{};
    double power = 0;
};

Entry entry_of(const scene::Light& light, const glm::dvec3& origin, double unit, double scene_radius) {
    Entry entry;
    auto& w = entry.words;
    const bool directional = light.kind == shared::LIGHT_DIRECTIONAL;
    const glm::dvec3 direction = glm::normalize(light.direction);
    const glm::dvec3 place = directional ? -direction : (light.position - origin) / unit;
    // Irradiance falls with the square of the distance, which is in device units.
    const glm::dvec3 strength = directional ? light.intensity : light.intensity / (unit * unit);
    // The cone's linear ramp in the cosine, as in KHR_lights_punctual.
    const double scale = 1 / std::max(0.001, std::cos(light.inner) - std::cos(light.outer));
    for (size_t i = 0; i < 3; ++i) {
        w[i] = word(place[int(i)]);
        w[4 + i] = word(strength[int(i)]);
        w[8 + i] = word(direction[int(i)]);
    }
    w[3] = light.kind;
    w[11] = word(light.range / unit);
    w[12] = word(scale);
    w[13] = word(-std::cos(light.outer) * scale);
    const double spread = directional ? std::numbers::pi * scene_radius * scene_radius : 4 * std::numbers::pi;
    entry.power = spread * mean(strength);
    return entry;
}

}  // namespace

AliasTable alias_table(const std::vector<double>& probabilities) {
    const size_t n = probabilities.size();
    AliasTable table{std::vector<double>(n, 1.0), std::vector<uint32_t>(n)};
    std::iota(table.alias.begin(), table.alias.end(), 0u);
    std::vector<double> shares(n);
    std::vector<uint32_t> small, large;
    for (size_t i = 0; i < n; ++i) {
        shares[i] = probabilities[i] * double(n);
        (shares[i] < 1 ? small : large).push_back(uint32_t(i));
    }
    while (!small.empty() && !large.empty()) {
        const uint32_t poor = small.back(), rich = large.back();
        small.pop_back();
        table.threshold[poor] = shares[poor];
        table.alias[poor] = rich;
        shares[rich] -= 1 - shares[poor];
        if (shares[rich] < 1) {
            large.pop_back();
            small.push_back(rich);
        }
    }
    return table;
}

LightTable light_table(const scene::MeshScene& scene, const glm::dvec3& origin, double unit,
                       const std::vector<uint32_t>& order, const std::vector<double>& emission) {
    const double radius = scene::bounds_of(scene).radius() / unit;
    std::vector<Entry> entries;
    for (const scene::Light& light : scene.lights)
        if (Entry entry = entry_of(light, origin, unit, radius); entry.power > 0) entries.push_back(entry);
    double total = 0;
    for (uint32_t place = 0; place < order.size(); ++place) {
        const scene::Triangle& t = scene.triangles[order[place]];
        const double radiance = emission[t.material];
        if (!(radiance > 0)) continue;
        const double area =
            0.5 * glm::length(glm::cross(t.corners[1] - t.corners[0], t.corners[2] - t.corners[0])) /
            (unit * unit);
        if (!(area > 0)) continue;
        Entry entry;
        entry.words[3] = shared::LIGHT_TRIANGLE;
        entry.words[11] = place;
        entry.power = std::numbers::pi * area * radiance;
        entries.push_back(entry);
    }
    for (const Entry& entry : entries) total += entry.power;

    LightTable table;
    table.count = uint32_t(entries.size());
    table.triangle_density.resize(scene.materials.size());
    if (total > 0)
        for (size_t i = 0; i < emission.size(); ++i)
            table.triangle_density[i] = std::numbers::pi * emission[i] / total;
    std::vector<double> probabilities;
    for (const Entry& entry : entries) probabilities.push_back(entry.power / total);
    const AliasTable alias = alias_table(probabilities);
    for (size_t i = 0; i < entries.size(); ++i) {
        auto& w = entries[i].words;
        w[7] = word(probabilities[i]);
        w[14] = word(alias.threshold[i]);
        w[15] = alias.alias[i];
        table.words.insert(table.words.end(), w.begin(), w.end());
    }
    return table;
}

}  // namespace ewa::pathtracer
