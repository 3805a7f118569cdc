// SPDX-License-Identifier: Apache-2.0
// Mesh scenes whose pictures have a known answer.
#pragma once
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/vec3.hpp>
#include <numbers>
#include <random>

#include "ewa/camera.h"
#include "scene/mesh_scene.h"

namespace ewa::test {

/// Reflects `albedo` in all directions alike, and nothing else.
inline scene::Material diffuse(const glm::vec3& albedo) {
    scene::Material m;
    m.base = albedo;
    m.metallic = m.f0 = m.f90 = 0;
    return m;
}

inline scene::Sky even_sky(float radiance) {
    return {glm::vec3(radiance), glm::vec3(radiance), glm::vec3(radiance)};
}

/// a b c d counter-clockwise seen from the front; uv (0,1) (1,1) (1,0) (0,0): a texture stands upright.
inline void add_quad(scene::MeshScene& scene, const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c,
                     const glm::dvec3& d, uint32_t material = 0) {
    scene::Triangle t;
    t.material = material;
    t.corners = {a, b, c};
    t.uvs = {glm::vec2(0, 1), glm::vec2(1, 1), glm::vec2(1, 0)};
    scene.triangles.push_back(t);
    t.corners = {a, c, d};
    t.uvs = {glm::vec2(0, 1), glm::vec2(1, 0), glm::vec2(0, 0)};
    scene.triangles.push_back(t);
}

/// A ball of flat triangles round the origin.
inline void add_ball(scene::MeshScene& scene, double radius, int rings, uint32_t material = 0) {
    const auto at = [&](int ring, int side) {
        const double up = std::numbers::pi * (double(ring) / rings - 0.5),
                     turn = std::numbers::pi * side / rings;
        return radius *
               glm::dvec3(std::cos(up) * std::sin(turn), std::sin(up), std::cos(up) * std::cos(turn));
    };
    for (int ring = 0; ring < rings; ++ring)
        for (int side = 0; side < 2 * rings; ++side)
            add_quad(scene, at(ring, side), at(ring, side + 1), at(ring + 1, side + 1), at(ring + 1, side),
                     material);
}

/// Triangles of all sizes anywhere in a cube, some of them needles and some without area.
inline scene::MeshScene random_triangles(uint32_t seed, size_t count) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> place(-10, 10), size(-2, 2);
    scene::MeshScene scene;
    scene.materials.push_back(diffuse(glm::vec3(0.5f)));
    for (size_t i = 0; i < count; ++i) {
        scene::Triangle t;
        const glm::dvec3 center(place(random), place(random), place(random));
        for (glm::dvec3& corner : t.corners)
            corner = center + glm::dvec3(size(random), size(random), size(random));
        if (i % 17 == 0) t.corners[2] = t.corners[1] + 1e-4 * (t.corners[1] - t.corners[0]);
        if (i % 53 == 0) t.corners[2] = t.corners[1];
        scene.triangles.push_back(t);
    }
    return scene;
}

/// Looks along -z from (x, y, z), y up, with square pixels and the axis through the middle.
inline Camera camera_down_z(const glm::dvec3& position, int width, int height, double focal) {
    Camera camera{width, height, focal, focal, 0.5 * width, 0.5 * height};
    camera.rotation = glm::dmat3(1, 0, 0, 0, -1, 0, 0, 0, -1);
    camera.translation = -(camera.rotation * position);
    return camera;
}

}  // namespace ewa::test
