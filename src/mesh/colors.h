// SPDX-License-Identifier: Apache-2.0
// Colours of a mesh's vertices from renders of the views.
#pragma once
#include <functional>
#include <span>

#include "ewa/camera.h"
#include "mesh/fusion.h"
#include "scene/triangle_mesh.h"

namespace ewa::mesh {

/// Fills mesh.colors: the mean over the views that see the vertex. The weight is the squared cosine between its normal and the direction
/// to the eye, because pixels at the edge of an object also have colours of the background. A view sees a vertex if its depth there is
/// that of the vertex, up to `within` of the vertex, world units. Other vertices get the mean of their neighbours. picture: RGB of view i.
/// mesh.normals must be set.
void set_colors(scene::TriangleMesh& mesh, std::span<const Camera> cameras, const DepthOfView& depth,
                const std::function<Image(size_t)>& picture,
                const std::function<double(const glm::dvec3&)>& within,
                const std::function<void(size_t)>& done = {});

}  // namespace ewa::mesh
