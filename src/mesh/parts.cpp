// SPDX-License-Identifier: Apache-2.0
#include "mesh/parts.h"

#include <algorithm>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <numeric>
#include <utility>

#include "mesh/meshing.h"

namespace ewa::mesh {
namespace {

using scene::TriangleMesh;

/// Vertices that triangles connect: find() is the same for all of a part.
class Union {
  public:
    explicit Union(const TriangleMesh& mesh) : parent_(mesh.positions.size()) {
        std::iota(parent_.begin(), parent_.end(), 0u);
        for (const auto& t : mesh.triangles) {
            join(t[0], t[1]);
            join(t[1], t[2]);
        }
    }
    uint32_t find(uint32_t i) {
        while (parent_[i] != i) i = parent_[i] = parent_[parent_[i]];
        return i;
    }

  private:
    /// The lower index leads, so that parts do not depend on the order of triangles.
    void join(uint32_t a, uint32_t b) {
        const auto [low, high] = std::minmax({find(a), find(b)});
        parent_[high] = low;
    }
    std::vector<uint32_t> parent_;
};

void drop_unused_vertices(TriangleMesh& mesh) {
    constexpr uint32_t kNone = ~0u;
    std::vector<uint32_t> place(mesh.positions.size(), kNone);
    for (const auto& t : mesh.triangles)
        for (const uint32_t i : t) place[i] = 0;
    uint32_t used = 0;
    for (size_t i = 0; i < place.size(); ++i) {
        if (place[i] == kNone) continue;
        mesh.positions[used] = mesh.positions[i];
        if (!mesh.colors.empty()) mesh.colors[used] = mesh.colors[i];
        place[i] = used++;
    }
    mesh.positions.resize(used);
    if (!mesh.colors.empty()) mesh.colors.resize(used);
    mesh.normals.clear();
    for (auto& t : mesh.triangles)
        for (uint32_t& i : t) i = place[i];
}

}  // namespace

Topology topology_of(const TriangleMesh& mesh) {
    Topology out;
    Union joined(mesh);
    std::vector<uint8_t> leads(mesh.positions.size());
    std::vector<std::pair<uint32_t, uint32_t>> edges;
    edges.reserve(3 * mesh.triangles.size());
    for (const auto& t : mesh.triangles) {
        leads[joined.find(t[0])] = 1;
        for (size_t k = 0; k < 3; ++k) edges.push_back(std::minmax(t[k], t[(k + 1) % 3]));
    }
    out.parts = size_t(std::ranges::count(leads, 1));
    std::ranges::sort(edges);
    for (size_t i = 0; i < edges.size();) {
        size_t end = i + 1;
        while (end < edges.size() && edges[end] == edges[i]) ++end;
        out.border_edges += end - i == 1;
        out.crowded_edges += end - i > 2;
        i = end;
    }
    return out;
}

size_t drop_small_parts(TriangleMesh& mesh, double least) {
    std::erase_if(mesh.triangles, [](const auto& t) { return t[0] == t[1] || t[1] == t[2] || t[2] == t[0]; });
    Union joined(mesh);
    std::vector<glm::vec3> low(mesh.positions.size(), glm::vec3(1e30f)), high(low.size(), glm::vec3(-1e30f));
    for (const auto& t : mesh.triangles)
        for (const uint32_t i : t) {
            const uint32_t part = joined.find(i);
            low[part] = glm::min(low[part], mesh.positions[i]);
            high[part] = glm::max(high[part], mesh.positions[i]);
        }
    size_t dropped = 0;
    std::vector<uint8_t> small(low.size());
    for (size_t part = 0; part < low.size(); ++part) {
        if (low[part].x > high[part].x) continue;
        small[part] = double(glm::length(high[part] - low[part])) < least;
        dropped += small[part];
    }
    std::erase_if(mesh.triangles, [&](const auto& t) { return small[joined.find(t[0])] != 0; });
    drop_unused_vertices(mesh);
    return dropped;
}

void simplify(TriangleMesh& mesh, size_t most) {
    if (mesh.triangles.size() <= most) return;
    mesh.triangles = meshing().simplify(mesh.positions, mesh.triangles, most);
    drop_unused_vertices(mesh);
}

void set_normals(TriangleMesh& mesh) {
    std::vector<glm::dvec3> sums(mesh.positions.size(), glm::dvec3(0));
    for (const auto& t : mesh.triangles) {
        const glm::dvec3 a(mesh.positions[t[0]]), b(mesh.positions[t[1]]), c(mesh.positions[t[2]]);
        const glm::dvec3 n = glm::cross(b - a, c - a);
        for (const uint32_t i : t) sums[i] += n;
    }
    // Where no triangle has an area: those of the neighbours. Programs refuse normals of another length than 1.
    const std::vector<glm::dvec3> of_areas = sums;
    for (const auto& t : mesh.triangles)
        for (const uint32_t to : t)
            for (const uint32_t from : t)
                if (!(glm::length(of_areas[to]) > 0) && glm::length(of_areas[from]) > 0)
                    sums[to] += glm::normalize(of_areas[from]);
    mesh.normals.clear();
    for (const glm::dvec3& sum : sums)
        mesh.normals.emplace_back(glm::length(sum) > 0 ? glm::normalize(sum) : glm::dvec3(0, 0, 1));
}

}  // namespace ewa::mesh
