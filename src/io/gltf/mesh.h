// SPDX-License-Identifier: Apache-2.0
// glTF 2.0 scenes of triangles, as .glb or .gltf. Buffers and images are files beside it or embedded.
#pragma once
#include <filesystem>
#include <glm/gtc/quaternion.hpp>
#include <glm/mat4x4.hpp>
#include <string>
#include <vector>

#include "scene/mesh_scene.h"

namespace ewa::io {

class GltfDocument;

/// Reads the default scene in the file's world:
///   triangles   modes 4, 5 and 6, with or without indices of any integer type; vertex colours
///   materials   factors and textures of base colour, metallic-roughness and emission; alpha modes
///   cameras     perspective ones
///   extensions  KHR_lights_punctual, KHR_materials_specular (factor), _ior, _unlit, _emissive_strength
///   sky         radiances in "extras": {"sky": {"zenith": [r, g, b], "horizon": [...], "ground": [...]}}
/// Images stay encoded. Triangles with a corner that is not finite are skipped and counted. Contents that a
/// render does not show are remarks. A required extension that is not listed, sparse accessors and compressed
/// ones are refused. The limits are kMostTriangles, and 16 times the file plus 20 MiB. Throws InputError that
/// names the file and the byte, or the mesh, node, material or accessor and its property. A file with splats
/// and without triangles is an InputError too.
scene::MeshScene read_gltf_mesh(const std::filesystem::path& path);

/// As read_gltf_mesh(). A mesh by write_glb_mesh() is turned back to the world of the splats that it was made of.
scene::MeshScene read_gltf_mesh_of_splats(const std::filesystem::path& path);

/// The rotation from the world of the splats to the file's, x, y, z and w: in "extras" of the "asset", and in a comment of an OBJ.
inline constexpr const char* kTurnOfSplats = "rotation_from_splats";
/// The inverse of `turn`: from the file's world to that of the splats. The identity if `turn` is no rotation.
glm::dmat3 undone_turn(const glm::dquat& turn);

/// Whether the file is a glTF whose meshes have triangles and no splats. False for anything else.
bool is_gltf_mesh(const std::filesystem::path& path);

/// Whether the file is a glTF with splats. False for anything else.
bool has_gltf_splats(const std::filesystem::path& path);

// The parts of read_gltf_mesh that are not triangles.

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
