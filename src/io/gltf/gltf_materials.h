// SPDX-License-Identifier: Apache-2.0
// Materials, textures, cameras, lights and sky of a glTF file.
#pragma once
#include "io/gltf/gltf_document.h"
#include "scene/mesh_scene.h"

namespace ewa::io {

/// Fills materials (the last is the default one, of primitives that name none), textures and images.
/// texture_sets: per material the TEXCOORD set that its textures use. Throws InputError that names the
/// material or texture.
void read_materials(const GltfDocument& document, scene::MeshScene& scene, std::vector<int>& texture_sets);

/// One remark of each kind.
void remark(scene::MeshScene& scene, const std::string& text);

/// Appends what the node, placed by `matrix`, carries. Throws InputError.
void add_camera(const GltfDocument& document, int node, const glm::dmat4& matrix, scene::MeshScene& scene);
void add_light(const GltfDocument& document, int node, const glm::dmat4& matrix, scene::MeshScene& scene);

/// The sky that the scene's "extras" say, else the default one. Throws InputError.
scene::Sky read_sky(const GltfDocument& document);

}  // namespace ewa::io
