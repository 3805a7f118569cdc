// SPDX-License-Identifier: Apache-2.0
// The parts and the border of a mesh; removing small parts and reducing triangles; transforms.
#pragma once
#include <cstddef>
#include <glm/mat4x4.hpp>
#include <string>

#include "scene/triangle_mesh.h"

namespace ewa::mesh {

struct Topology {
    size_t parts = 0;          // connected by shared vertices
    size_t border_edges = 0;   // of one triangle
    size_t crowded_edges = 0;  // of more than two
    size_t holes = 0;  // border edges connected by shared vertices; the outer edge of a surface is one, too
    double largest_hole = 0;  // the diagonal of its box
    /// Whether the surface has an inside: every edge is that of two triangles.
    bool watertight() const { return border_edges == 0 && crowded_edges == 0; }
};
Topology topology_of(const scene::TriangleMesh& mesh);

/// "watertight", or the reason why the surface is not.
std::string watertight_text(const Topology& topology);

/// Drops parts whose box has a diagonal below `least`, triangles with two equal corners, and vertices without triangles.
/// Returns the number of dropped parts.
size_t drop_small_parts(scene::TriangleMesh& mesh, double least);

/// Reduces the mesh to at most `most` triangles, if the topology allows it. Throws RunError if libewa_meshing.so is missing.
void simplify(scene::TriangleMesh& mesh, size_t most);

/// Fills mesh.normals with means over the triangles at a vertex, weighted by their area. Where none has an area, they are means over the
/// neighbours, or z.
void set_normals(scene::TriangleMesh& mesh);

/// Applies an affine transform to positions and normals. A mirrored mesh keeps its front. Throws InputError if the transform flattens
/// space, or if a position leaves the range of float32.
void transform_mesh(scene::TriangleMesh& mesh, const glm::dmat4& matrix);

}  // namespace ewa::mesh
