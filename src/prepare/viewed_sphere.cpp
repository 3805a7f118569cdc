// SPDX-License-Identifier: Apache-2.0
#include "prepare/viewed_sphere.h"

#include <algorithm>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>

namespace ewa::train {

glm::dvec3 viewing_direction(const Camera& camera) {
    return glm::normalize(glm::transpose(camera.rotation) * glm::dvec3(0, 0, 1));
}

Sphere viewed_sphere(const Dataset& dataset, const std::vector<int>& frames) {
    glm::dvec3 mean(0.0);
    for (const int i : frames) mean += dataset.frames[i].camera.position() / double(frames.size());

    // The sum of squared distances from the axes is least where sum(I - d d^T) (p - o) = 0. Positions are
    // relative to their mean, so a scene far from the origin loses no digits.
    glm::dmat3 normal(0.0);
    glm::dvec3 right(0.0);
    for (const int i : frames) {
        const glm::dvec3 d = viewing_direction(dataset.frames[i].camera);
        const glm::dmat3 across = glm::dmat3(1.0) - glm::outerProduct(d, d);
        normal += across;
        right += across * (dataset.frames[i].camera.position() - mean);
    }
    const double count = double(frames.size());
    // The determinant is near 0 if the axes are nearly parallel. Its largest value is 8/27 of the cubed count,
    // for directions in all of space.
    if (glm::determinant(normal) > 1e-4 * count * count * count) {
        const glm::dvec3 offset = glm::inverse(normal) * right;
        double distance = 0, towards = 0;
        for (const int i : frames) {
            const glm::dvec3 to_center = mean + offset - dataset.frames[i].camera.position();
            distance += glm::length(to_center) / count;
            towards += glm::dot(to_center, viewing_direction(dataset.frames[i].camera));
        }
        if (towards > 0.5 * distance * count) return {mean + offset, distance};
    }
    double farthest = 0;
    for (const int i : frames)
        farthest = std::max(farthest, glm::length(dataset.frames[i].camera.position() - mean));
    return {mean, farthest > 0 ? 4 * farthest : 1};
}

}  // namespace ewa::train
