// SPDX-License-Identifier: Apache-2.0
// The mesh of the surfaces in a splat scene, from the depth that views of it have.
#pragma once
#include <cstddef>
#include <functional>
#include <glm/mat4x4.hpp>
#include <string>

#include "ewa/renderer.h"
#include "mesh/fusion.h"
#include "mesh/pinholes.h"

namespace ewa::mesh {

/// The options of ewa mesh.
struct SceneMeshOptions {
    double voxel = 0;         // world units; 0: two pixels on the surfaces
    size_t triangles = 0;     // at most; 0: all
    bool mean_depth = false;  // surfaces are at the mean depth of the splats; else at the median
    bool unbounded = false, collision = false;
    glm::dmat4 placement{1.0};  // of the mesh
};

struct SceneMesh {
    Fused fused;
    size_t most_triangles = 0;  // that were asked for; 0: all
    std::string note;           // for the user; may be empty
};

/// Cameras around the scene in all directions, for splats whose training cameras are not known.
Pinholes cameras_around(const Gaussians& gaussians);

/// The number of steps that mesh_of_scene() reports to `done`.
size_t steps_of_mesh(const Pinholes& pinholes, const SceneMeshOptions& options);

/// renderer: of the splats. done: called with the steps that are done; what it throws ends the work. Throws InputError (no surface, or a
/// placement that flattens space), RunError (device, or the module of meshes is missing).
SceneMesh mesh_of_scene(Renderer& renderer, const Pinholes& pinholes, const SceneMeshOptions& options,
                        const std::function<void(size_t)>& done);

}  // namespace ewa::mesh
