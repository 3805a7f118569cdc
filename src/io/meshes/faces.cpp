// SPDX-License-Identifier: Apache-2.0
#include "io/meshes/faces.h"

#include <charconv>
#include <cmath>

namespace ewa::io {
namespace {

/// A list's value may be any number.
std::string index_text(double index) {
    char text[32];
    const auto end = std::to_chars(text, text + sizeof(text), index).ptr;
    return std::string(text, end);
}

}  // namespace

void FaceCollector::add_face(std::span<const double> indices) {
    // A short row of small numbers must not become many large triangles.
    constexpr uint64_t kTimesFile = 16, kFree = uint64_t(20) << 20;
    for (const double index : indices)
        if (!(index >= 0 && index < double(positions_.size()) && index == std::floor(index)))
            fail_("a face has the corner \"" + index_text(index) + "\" (from 0), but there are " +
                  std::to_string(positions_.size()) + " vertices");
    if (indices.size() < 3) return;
    const uint64_t all = scene_.triangles.size() + scene_.dropped_triangles + indices.size() - 2;
    if (all > scene::kMostTriangles)
        fail_("the mesh claims more than " + std::to_string(scene::kMostTriangles) + " triangles");
    if (all * sizeof(scene::Triangle) > kTimesFile * file_bytes_ + kFree)
        fail_("the mesh claims " + std::to_string(all) + " triangles, which take more than " +
              std::to_string(kTimesFile) + " times the file and 20 MiB");
    for (size_t i = 2; i < indices.size(); ++i)
        add_triangle(size_t(indices[0]), size_t(indices[i - 1]), size_t(indices[i]));
}

void FaceCollector::add_triangle(size_t a, size_t b, size_t c) {
    scene::Triangle triangle;
    triangle.corners = {positions_[a], positions_[b], positions_[c]};
    for (const glm::dvec3& corner : triangle.corners)
        for (int axis = 0; axis < 3; ++axis)
            if (!std::isfinite(float(corner[axis]))) {
                ++scene_.dropped_triangles;
                return;
            }
    scene_.triangles.push_back(triangle);
}

scene::MeshScene FaceCollector::take() {
    if (scene_.triangles.empty() && scene_.dropped_triangles > 0)
        fail_("no face of the mesh has corners that are all finite");
    if (scene_.triangles.empty()) fail_("the mesh has no face of three corners or more");
    scene_.materials.emplace_back();
    return std::move(scene_);
}

}  // namespace ewa::io
