// SPDX-License-Identifier: Apache-2.0
// A scene of triangles with materials, lights and cameras, in the world of its file. Values are linear light.
#pragma once
#include <array>
#include <cstdint>
#include <glm/mat3x3.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <optional>
#include <string>
#include <vector>

#include "shared/layouts.h"

namespace ewa::scene {

/// The most triangles of a scene. References from the leaves of the ray tracing tree and a few GB of memory suffice for no more.
inline constexpr size_t kMostTriangles = size_t(1) << 22;

/// The packed normal of a triangle without normals in its file, which is flat.
inline constexpr uint32_t kNoNormal = 0x80008000u;

struct Triangle {
    std::array<glm::dvec3, 3> corners;  // world units; counter-clockwise from the front
    std::array<uint32_t, 3> normals{kNoNormal, kNoNormal, kNoNormal};  // see pack_normal
    std::array<uint32_t, 3> colors{~0u, ~0u, ~0u};                     // RGBA, linear, 8 bits each, R lowest
    std::array<glm::vec2, 3> uvs{};
    uint32_t material = 0;
};

/// Octahedral encoding (Meyer et al. 2010), x in the lower 16 bits. A zero vector becomes kNoNormal.
uint32_t pack_normal(const glm::dvec3& normal);

struct Texture {
    int image = -1;  // index into MeshScene::images
    uint32_t wrap_s = shared::WRAP_REPEAT, wrap_t = shared::WRAP_REPEAT;
    bool nearest = false;
};

struct Material {
    glm::vec3 base{1.0f}, emitted{0.0f};
    float opacity = 1;
    float metallic = 1, roughness = 1;
    float f0 = 0.04f, f90 = 1;  // reflectance of the dielectric at normal and grazing incidence
    float cutoff = 0.5f;
    int base_texture = -1, metal_texture = -1, emitted_texture = -1;  // indices into MeshScene::textures
    bool two_sided = false, masked = false, blended = false, unlit = false;

    /// Whether its reflection depends on the direction of view.
    bool glossy() const { return f0 > 0 || f90 > 0 || metallic > 0; }
};

struct Light {
    uint32_t kind = shared::LIGHT_POINT;  // directional, point or spot
    glm::dvec3 position{0.0};
    glm::dvec3 direction{0, 0, -1};                // the direction that the light shines in
    glm::dvec3 intensity{1.0};                     // W/sr or candela; directional: W/m^2 or lux; per channel
    double range = 0;                              // 0: infinite
    double inner = 0, outer = 0.7853981633974483;  // half angles of a spot, radians
};

struct FileCamera {
    std::string name;
    glm::dmat3 axes{1.0};  // columns: right, up, back, in world axes
    glm::dvec3 position{0.0};
    double vertical_angle = 0;  // radians
};

/// Radiance straight up, level and straight down. Between these, it is linear in the height of the direction.
struct Sky {
    glm::vec3 zenith{0.30f, 0.45f, 0.75f}, horizon{0.75f, 0.80f, 0.85f}, ground{0.20f, 0.18f, 0.16f};
};

struct EncodedImage {
    std::string what;  // name of the image in errors
    std::vector<unsigned char> bytes;
};

struct MeshScene {
    std::vector<Triangle> triangles;
    std::vector<Material> materials;  // at least one
    std::vector<Texture> textures;
    std::vector<EncodedImage> images;
    std::vector<Light> lights;
    std::vector<FileCamera> cameras;
    Sky sky;
    size_t dropped_triangles = 0;      // with a corner that is not finite
    std::vector<std::string> remarks;  // contents of the file that a render does not show
};

/// Whether the colour of some surface depends on the direction of view. If not, SH degree 0 suffices.
bool color_depends_on_view(const MeshScene& scene);

struct Box {
    glm::dvec3 low{1e300}, high{-1e300};
    glm::dvec3 center() const { return 0.5 * (low + high); }
    double radius() const;  // of the bounding sphere
};
Box bounds_of(const MeshScene& scene);

}  // namespace ewa::scene
