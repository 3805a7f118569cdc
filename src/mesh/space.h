// SPDX-License-Identifier: Apache-2.0
// The space in which a mesh is made: the world about a middle. Beyond a radius it is contracted, so that all of the world lies within
// twice that radius (Mip-NeRF 360, Barron et al. 2022): a point x from the middle is at (2 - r / |x|) r x / |x|.
#pragma once
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/vec3.hpp>
#include <limits>

namespace ewa::mesh {

struct Space {
    glm::dvec3 middle{0};                                     // world
    double radius = std::numeric_limits<double>::infinity();  // world units; infinity: nothing is contracted

    glm::dvec3 contracted(const glm::dvec3& world) const {
        const glm::dvec3 x = world - middle;
        const double far = glm::length(x) / radius;
        return far > 1 ? (2 - 1 / far) / far * x : x;
    }
    /// The inverse of `contracted`, relative to the middle, world units. at: of a length below 2 radius.
    glm::dvec3 expanded(const glm::dvec3& at) const {
        const double share = glm::length(at) / radius;
        return share > 1 ? 1 / (share * (2 - share)) * at : at;
    }
    /// The derivative of `contracted` along a direction.
    glm::dvec3 contracted_direction(const glm::dvec3& world, const glm::dvec3& direction) const {
        const glm::dvec3 x = world - middle;
        const double far = glm::length(x) / radius;
        if (!(far > 1)) return direction;
        const glm::dvec3 out = glm::normalize(x);
        const glm::dvec3 outward = glm::dot(direction, out) * out;
        return outward / (far * far) + (direction - outward) / growth(world);
    }
    /// The ratio of world length to contracted length, for directions perpendicular to the line from the middle.
    double growth(const glm::dvec3& world) const {
        const double far = glm::length(world - middle) / radius;
        return far > 1 ? far / (2 - 1 / far) : 1;
    }
    /// The ratio of world length to contracted length along the line from the middle, where it is largest.
    double outward_growth(const glm::dvec3& world) const {
        const double far = glm::length(world - middle) / radius;
        return far > 1 ? far * far : 1;
    }
};

}  // namespace ewa::mesh
