// SPDX-License-Identifier: Apache-2.0
// Materials, textures, cameras, lights and sky of a glTF file.
#pragma once
#include "io/gltf/document.h"
#include "scene/mesh_scene.h"

namespace ewa::io {

/// Fills materials, textures and images. The last material is the default of primitives that name none.
/// texture_sets gets each material's TEXCOORD set. Throws InputError that names the material or texture.
void read_materials(const GltfDocument& document, scene::MeshScene& scene, std::vector<int>& texture_sets);

/// Adds a remark unless it is present.
void remark(scene::MeshScene& scene, const std::string& text);

/// Appends the camera or light of a node that `matrix` places in the world. Throws InputError.
void add_camera(const GltfDocument& document, int node, const glm::dmat4& matrix, scene::MeshScene& scene);
void add_light(const GltfDocument& document, int node, const glm::dmat4& matrix, scene::MeshScene& scene);

/// The sky in the scene's "extras", or the default one. Throws InputError.
scene::Sky read_sky(const GltfDocument& document);

}  // namespace ewa::io
