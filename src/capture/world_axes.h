// SPDX-License-Identifier: Apache-2.0
// Chooses the axes, scale and origin of the world, which COLMAP's reconstruction does not determine. y points down. With GPS, x
// points east, z north, and the unit is the metre.
#pragma once
#include <filesystem>
#include <glm/mat3x3.hpp>
#include <glm/vec3.hpp>
#include <map>
#include <optional>
#include <string>

#include "capture/sparse_model.h"
#include "image/image_files.h"
#include "io/splats/place.h"

namespace ewa::capture {

/// Facts about a photo's camera that its file states.
struct PhotoFacts {
    int orientation = 1;  // EXIF's orientation of the pixels: 1 if they are upright
    std::optional<image::GpsFix> gps;
};

/// From COLMAP's world to the new one: x becomes scale * rotation * x + shift.
struct WorldAxes {
    double scale = 1;
    glm::dmat3 rotation{1};
    glm::dvec3 shift{0};
    std::optional<io::Place> place;  // of the new origin
    std::string text;                // a line about the new axes for the user; empty: the axes did not change
};

/// facts: by photo name. Photos without facts count as upright and without GPS. The same input gives the same axes.
///
/// - Up: the direction perpendicular to the horizontal axes of the cameras, since people and gimbals hold these axes level. If that
///   is ambiguous, the cameras' mean up direction. For photos straight down, the opposite of their mean viewing direction.
/// - The ground: the plane with the most points, if most cameras are above it and its normal is near the up direction. Without GPS,
///   this normal becomes the up direction, since cameras are tilted by some degrees.
/// - GPS: scale, heading and position by a robust fit of a similarity of the horizontal plane. A few photos with wrong GPS do not change it.
///   Altitudes level the scene if they determine that better than the cameras.
WorldAxes world_axes(const SparseModel& model, const std::map<std::string, PhotoFacts>& facts);

/// Transforms the model in a folder to its world_axes(). place: the file for the place on the globe, if it is known. photos: the
/// folder with the model's photos. Returns WorldAxes::text. Throws InputError if the model cannot be read, RunError.
std::string set_world_axes(const std::filesystem::path& model, const std::filesystem::path& photos,
                           const std::filesystem::path& place);

}  // namespace ewa::capture
