// SPDX-License-Identifier: Apache-2.0
// A scene as the buffers for lib/mesh.glsl, lib/traversal.glsl and lib/lights.glsl.
#pragma once
#include <array>
#include <cstdint>
#include <glm/vec3.hpp>
#include <string>
#include <vector>

#include "ewa/camera.h"
#include "ewa/image.h"
#include "pathtracer/hierarchy.h"
#include "scene/mesh_scene.h"

namespace ewa::pathtracer {

/// The limit on the texels of all textures together, which is 256 MiB.
inline constexpr uint64_t kMostTexels = uint64_t(1) << 26;

/// Device coordinates are (world - origin) / unit. The origin is the scene's centre, the unit a power of two
/// that makes its radius 8 to 16.
struct PackedScene {
    /// Whole rgba32ui texels, at least one.
    std::vector<uint32_t> nodes, triangles, surfaces, materials, textures, lights;
    std::vector<uint32_t> texels;  // RGBA, 8 bits each
    uint32_t light_count = 0;
    bool alpha_tested = false;
    glm::dvec3 origin{0.0};
    double unit = 1;
    std::vector<uint32_t> order;  // the scene's triangle at each sorted index
};

/// `images` are the scene's decoded images with 3 or 4 channels. An empty image is white. Throws InputError
/// for a scene without triangles, or above kMostTriangles or kMostTexels.
PackedScene pack(const scene::MeshScene& scene, const std::vector<Image>& images);

/// Vose's alias method (1991): for a random number in [0, 1), entry i selects i below threshold[i], else
/// alias[i].
struct AliasTable {
    std::vector<double> threshold;
    std::vector<uint32_t> alias;
};
AliasTable alias_table(const std::vector<double>& probabilities);

/// The triangles in device coordinates and in sorted order, for the CPU reference.
struct DeviceTriangle {
    glm::vec3 corner, edge1, edge2;
};
std::vector<DeviceTriangle> device_triangles(const PackedScene& packed);

/// The hierarchy in device coordinates, for the CPU reference.
std::vector<Node> device_nodes(const PackedScene& packed);

}  // namespace ewa::pathtracer
