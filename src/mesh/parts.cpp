// SPDX-License-Identifier: Apache-2.0
#include "mesh/parts.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/gtc/matrix_inverse.hpp>
#include <limits>
#include <numeric>
#include <utility>

#include "core/typing.h"
#include "ewa/error.h"
#include "mesh/meshing.h"
#include "scene/splat_shape.h"

namespace ewa::mesh {
namespace {

using scene::TriangleMesh;

/// Vertices that triangles connect: find() is the same for all of a part.
class Union {
  public:
    explicit Union(size_t vertices) : parent_(vertices) { std::iota(parent_.begin(), parent_.end(), 0u); }
    explicit Union(const TriangleMesh& mesh) : Union(mesh.positions.size()) {
        for (const auto& t : mesh.triangles) {
            join(t[0], t[1]);
            join(t[1], t[2]);
        }
    }
    uint32_t find(uint32_t i) {
        while (parent_[i] != i) i = parent_[i] = parent_[parent_[i]];
        return i;
    }
    /// The lower index leads, so that parts do not depend on the order of triangles.
    void join(uint32_t a, uint32_t b) {
        const auto [low, high] = std::minmax({find(a), find(b)});
        parent_[high] = low;
    }

  private:
    std::vector<uint32_t> parent_;
};

using Edge = std::pair<uint32_t, uint32_t>;

/// Boxes of vertices that belong together, by the vertex that leads them.
struct Boxes {
    explicit Boxes(size_t vertices) : low(vertices, glm::vec3(1e30f)), high(vertices, glm::vec3(-1e30f)) {}
    void add(uint32_t leader, const glm::vec3& position) {
        low[leader] = glm::min(low[leader], position);
        high[leader] = glm::max(high[leader], position);
    }
    bool any(size_t leader) const { return low[leader].x <= high[leader].x; }
    double diagonal(size_t leader) const { return double(glm::length(high[leader] - low[leader])); }
    std::vector<glm::vec3> low, high;
};

void measure_holes(const TriangleMesh& mesh, const std::vector<Edge>& border, Topology& out) {
    Union joined(mesh.positions.size());
    for (const auto& [a, b] : border) joined.join(a, b);
    Boxes boxes(mesh.positions.size());
    for (const auto& [a, b] : border)
        for (const uint32_t i : {a, b}) boxes.add(joined.find(i), mesh.positions[i]);
    for (size_t i = 0; i < mesh.positions.size(); ++i) {
        if (!boxes.any(i)) continue;
        ++out.holes;
        out.largest_hole = std::max(out.largest_hole, boxes.diagonal(i));
    }
}

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
    std::vector<Edge> edges, border;
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
        if (end - i == 1) border.push_back(edges[i]);
        out.crowded_edges += end - i > 2;
        i = end;
    }
    out.border_edges = border.size();
    if (!border.empty()) measure_holes(mesh, border, out);
    return out;
}

std::string watertight_text(const Topology& topology) {
    if (topology.watertight()) return "watertight";
    std::string text = "not watertight: ";
    if (topology.holes > 0)
        text += fmt::format("{} of {}, the largest {:.3g} across", core::counted(topology.holes, "hole"),
                            core::counted(topology.border_edges, "edge"), topology.largest_hole);
    if (topology.crowded_edges > 0)
        text += fmt::format("{}{} of more than two triangles", topology.holes > 0 ? ", " : "",
                            core::counted(topology.crowded_edges, "edge"));
    return text;
}

size_t drop_small_parts(TriangleMesh& mesh, double least) {
    std::erase_if(mesh.triangles, [](const auto& t) { return t[0] == t[1] || t[1] == t[2] || t[2] == t[0]; });
    Union joined(mesh);
    Boxes boxes(mesh.positions.size());
    for (const auto& t : mesh.triangles)
        for (const uint32_t i : t) boxes.add(joined.find(i), mesh.positions[i]);
    size_t dropped = 0;
    std::vector<uint8_t> small(mesh.positions.size());
    for (size_t part = 0; part < small.size(); ++part) {
        if (!boxes.any(part)) continue;
        small[part] = boxes.diagonal(part) < least;
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

void transform_mesh(TriangleMesh& mesh, const glm::dmat4& matrix) {
    scene::check_transform(matrix);
    const glm::dmat3 linear(matrix), cofactors = glm::determinant(linear) * glm::inverseTranspose(linear);
    mesh.origin = glm::dvec3(matrix * glm::dvec4(mesh.origin, 1));
    for (glm::vec3& p : mesh.positions) {
        p = glm::vec3(linear * glm::dvec3(p));
        if (!(glm::length(glm::dvec3(p)) <= double(std::numeric_limits<float>::max())))
            throw InputError("the transform makes the mesh too large for its numbers");
    }
    const bool mirrored = glm::determinant(linear) < 0;
    for (glm::vec3& n : mesh.normals)
        n = glm::vec3(glm::normalize((mirrored ? -1.0 : 1.0) * (cofactors * glm::dvec3(n))));
    if (mirrored)
        for (auto& t : mesh.triangles) std::swap(t[1], t[2]);
}

}  // namespace ewa::mesh
