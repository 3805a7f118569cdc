// SPDX-License-Identifier: Apache-2.0
// The float64 CPU reference of shaders/lib/traversal.glsl.
#pragma once
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <optional>
#include <span>

#include "pathtracer/packing.h"

namespace ewa::reference {

struct Ray {
    glm::dvec3 origin, direction;  // the length of the direction is the unit of distances
    double reach = 1e300;
};

struct Hit {
    uint32_t triangle = 0;
    double distance = 0;
    glm::dvec2 barycentric{0.0};  // weights of corners 1 and 2
};

/// The intersection of a ray and a triangle, from either side, edges included (Moeller and Trumbore 1997).
std::optional<Hit> meet(const Ray& ray, const pathtracer::DeviceTriangle& triangle);

/// The nearest hit, by testing every triangle.
std::optional<Hit> nearest_of_all(const Ray& ray, std::span<const pathtracer::DeviceTriangle> triangles);

/// The nearest hit, by traversing the hierarchy in the order of the shader. deepest: receives the largest size of the stack.
std::optional<Hit> trace(const Ray& ray, std::span<const pathtracer::Node> nodes,
                         std::span<const pathtracer::DeviceTriangle> triangles, size_t* deepest = nullptr);

}  // namespace ewa::reference
