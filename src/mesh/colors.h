// SPDX-License-Identifier: Apache-2.0
// Colours of a mesh's vertices from pictures of the views.
#pragma once
#include <functional>
#include <span>

#include "ewa/camera.h"
#include "mesh/fusion.h"
#include "scene/triangle_mesh.h"

namespace ewa::mesh {

/// Fills mesh.colors: the mean over the views that see the vertex, weighted by the squared cosine between its normal and the direction to the
/// eye: at the edge of a thing a picture shows some of what is behind it. A view sees it where its depth there is that of the vertex to within `within` of the vertex, world units. Vertices that no view sees get the
/// mean of their neighbours. picture: RGB of view i. mesh.normals must be set.
void set_colors(scene::TriangleMesh& mesh, std::span<const Camera> cameras, const DepthOfView& depth,
                const std::function<Image(size_t)>& picture,
                const std::function<double(const glm::dvec3&)>& within,
                const std::function<void(size_t)>& done = {});

}  // namespace ewa::mesh
