// SPDX-License-Identifier: Apache-2.0
// How far two surfaces are apart.
#pragma once
#include <array>
#include <cstddef>
#include <glm/vec3.hpp>
#include <vector>

#include "pathtracer/hierarchy.h"
#include "scene/mesh_scene.h"
#include "scene/triangle_mesh.h"

namespace ewa::mesh {

/// Triangles, or the points of a scan, with a search for the nearest point of them to a given one.
class Surface {
  public:
    /// At least one of the scene's triangles has an area.
    explicit Surface(const scene::MeshScene& scene);
    /// The points of a scan: triangles without an area. At least one.
    explicit Surface(const std::vector<glm::dvec3>& points);

    struct Nearest {
        double distance = 0;  // world units
        size_t triangle = 0;
        glm::dvec3 normal{0};  // of the triangle, of length 1; of points: 0
    };
    Nearest nearest(const glm::dvec3& point) const;

    struct Point {
        glm::dvec3 position{0}, normal{0};  // normal of points: 0
    };
    /// Point i of `count` points that are spread evenly over the area. seed, i and count decide where it is. A scan gives one of its points;
    /// each is there once if count is their number.
    Point sample(size_t i, size_t count, uint32_t seed) const;

    bool scan() const { return scan_; }
    size_t size() const { return triangles_.size(); }  // triangles, or points of a scan
    double area() const { return areas_.empty() ? 0 : areas_.back(); }
    double diagonal() const;  // of the box around all triangles

  private:
    std::vector<std::array<glm::dvec3, 3>> triangles_;  // those with an area
    std::vector<double> areas_;                         // summed up to and including each; of a scan: empty
    bool scan_ = false;
    pathtracer::Hierarchy hierarchy_;
};

struct SurfaceComparison {
    double threshold = 0;                         // world units
    size_t points_a = 100000, points_b = 100000;  // above 0
};

struct SurfaceDifference {
    double accuracy = 0;      // mean distance of points of A from B
    double completeness = 0;  // mean distance of points of B from A
    double chamfer() const { return (accuracy + completeness) / 2; }
    double threshold = 0;
    double precision = 0;  // share of A's points within the threshold
    double recall = 0;     // share of B's points within the threshold
    double f_score() const {
        return precision + recall > 0 ? 2 * precision * recall / (precision + recall) : 0;
    }
    /// Mean angle between the normals of A and B without their signs, degrees. NaN with a scan.
    double normal_error = 0;
};

SurfaceDifference difference(const Surface& a, const Surface& b, const SurfaceComparison& comparison);

/// The triangles as a mesh whose vertices at equal places are one, for its topology.
scene::TriangleMesh joined(const scene::MeshScene& scene);

}  // namespace ewa::mesh
