// SPDX-License-Identifier: Apache-2.0
// COLMAP's model with its observations: which feature of which image shows which point (colmap.github.io/format.html).
#pragma once
#include <array>
#include <cstdint>
#include <filesystem>
#include <glm/mat3x3.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <limits>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "ewa/camera.h"

namespace ewa::capture {

constexpr uint64_t kNoPoint = std::numeric_limits<uint64_t>::max();

struct SparseCamera {
    int32_t lens = 0;  // COLMAP's model id
    uint64_t width = 0, height = 0;
    std::vector<double> parameters;
};

/// A feature of an image.
struct SparseFeature {
    glm::dvec2 at{0};           // px
    uint64_t point = kNoPoint;  // the point that it shows
};

struct SparseImage {
    std::array<double, 7> pose{1};  // qw qx qy qz tx ty tz, world to camera
    uint32_t camera = 0;
    std::string name;
    std::vector<SparseFeature> features;
};

struct SparsePoint {
    glm::dvec3 position{0};
    std::array<uint8_t, 3> color{};
    double error = 0;                                  // px
    std::vector<std::pair<uint32_t, uint32_t>> track;  // images, and the places of their features
};

/// A model, by COLMAP's ids of cameras, images and points.
struct SparseModel {
    std::map<uint32_t, SparseCamera> cameras;
    std::map<uint32_t, SparseImage> images;
    std::map<uint64_t, SparsePoint> points;
};

/// Throws InputError where a file of the model (.bin) is damaged, or has a lens that ewa does not know.
SparseModel read_sparse(const std::filesystem::path& folder);
/// Writes the model (.bin) into the folder, which is created. Throws RunError.
void write_sparse(const SparseModel& model, const std::filesystem::path& folder);

/// The image's camera, with its lens.
Camera camera_of(const SparseModel& model, const SparseImage& image);

/// Moves cameras and points: x becomes scale * rotation * x + shift.
void move(SparseModel& model, double scale, const glm::dmat3& rotation, const glm::dvec3& shift);

/// How far a feature is from the image of the point that it shows, px. Infinite for a point behind the camera.
double reprojection_error(const Camera& camera, const glm::dvec3& point, const glm::dvec2& at);

}  // namespace ewa::capture
