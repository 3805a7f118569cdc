// SPDX-License-Identifier: Apache-2.0
#include "mesh/middle.h"

#include <algorithm>
#include <glm/mat3x3.hpp>
#include <glm/matrix.hpp>
#include <vector>

#include "scene/statistics.h"

namespace ewa::mesh {
namespace {

constexpr double kParallel = 1e-3;    // determinant of the mean projection across the axes: about 2 degrees
constexpr double kLeastInside = 0.1;  // of the pixels

/// Calls add(camera, point in the world, view z) for pixels of all views. Every view has the same say, whatever its size.
template <class Add>
void for_pixels(std::span<const Camera> cameras, const DepthOfView& depth, const Add& add) {
    constexpr size_t kSamples = 10000;
    for (size_t i = 0; i < cameras.size(); ++i) {
        const Image& image = depth(i);
        const Camera& camera = cameras[i];
        const glm::dmat3 to_world = glm::transpose(camera.rotation);
        const size_t step = std::max<size_t>(1, image.pixels.size() / kSamples);
        for (size_t p = 0; p < image.pixels.size(); p += step) {
            const double z = double(image.pixels[p]);
            if (!(z > 0)) continue;
            const size_t column = p % size_t(image.width), row = p / size_t(image.width);
            const double x = double(column) + 0.5, y = double(row) + 0.5;
            const glm::dvec3 ray((x - camera.cx) / camera.fx, (y - camera.cy) / camera.fy, 1);
            add(camera, to_world * (z * ray - camera.translation), z);
        }
    }
}

/// The point with the least mean square distance from the axes.
glm::dvec3 focus_of(std::span<const Camera> cameras, double median_depth) {
    glm::dmat3 across(0);
    glm::dvec3 sum(0), ahead(0);
    for (const Camera& camera : cameras) {
        const glm::dvec3 axis = glm::transpose(camera.rotation) * glm::dvec3(0, 0, 1);
        const glm::dmat3 from_axis = glm::dmat3(1) - glm::outerProduct(axis, axis);
        across += from_axis;
        sum += from_axis * camera.position();
        ahead += camera.position() + median_depth * axis;
    }
    const double share = 1 / double(cameras.size());
    return glm::determinant(share * across) < kParallel ? share * ahead : glm::inverse(across) * sum;
}

}  // namespace

Space space_of_views(std::span<const Camera> cameras, const DepthOfView& depth) {
    std::vector<float> values;
    for_pixels(cameras, depth,
               [&](const Camera&, const glm::dvec3&, double z) { values.push_back(float(z)); });
    Space space;
    space.middle = focus_of(cameras, scene::quantile(values, 0.5));
    values.clear();
    for_pixels(cameras, depth, [&](const Camera&, const glm::dvec3& point, double) {
        values.push_back(float(glm::length(point - space.middle)));
    });
    std::vector<double> distances;
    for (const Camera& camera : cameras) distances.push_back(glm::length(camera.position() - space.middle));
    space.radius = std::max(scene::quantile(distances, 0.5), double(scene::quantile(values, kLeastInside)));
    return space;
}

double usual_voxel(std::span<const Camera> cameras, const DepthOfView& depth, const Space& space) {
    std::vector<float> sides;
    for_pixels(cameras, depth, [&](const Camera& camera, const glm::dvec3& point, double z) {
        if (glm::length(point - space.middle) <= space.radius)
            sides.push_back(float(z) / float(focal(camera)));
    });
    return kVoxelPixels * scene::quantile(sides, 0.5);
}

}  // namespace ewa::mesh
