// SPDX-License-Identifier: Apache-2.0
// A scene as the buffers that lib/mesh.glsl, lib/traversal.glsl and lib/lights.glsl read.
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

/// Texels of all textures together: 256 MiB.
inline constexpr uint64_t kMostTexels = uint64_t(1) << 26;

/// Device coordinates are (world - origin) / unit: the scene's middle, and a power of two that makes its
/// radius 8 to 16.
struct PackedScene {
    std::vector<uint32_t> nodes, triangles, surfaces, materials, textures,
        lights;                    // whole rgba32ui texels, one at least
    std::vector<uint32_t> texels;  // RGBA, 8 bits each
    uint32_t light_count = 0;
    bool alpha_tested = false;
    glm::dvec3 origin{0.0};
    double unit = 1;
    std::vector<uint32_t> order;  // the scene's triangle that stands at each place
};

/// images: those of the scene, decoded, 3 or 4 channels; an empty one stands for white. Throws InputError for
/// a scene without triangles, or more than kMostTriangles or kMostTexels.
PackedScene pack(const scene::MeshScene& scene, const std::vector<Image>& images);

/// The corners as the device has them, in the order of PackedScene::order, for the twin.
struct DeviceTriangle {
    glm::vec3 corner, edge1, edge2;
};
std::vector<DeviceTriangle> device_triangles(const PackedScene& packed);

/// The hierarchy as the device has it.
std::vector<Node> device_nodes(const PackedScene& packed);

}  // namespace ewa::pathtracer
