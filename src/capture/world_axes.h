// SPDX-License-Identifier: Apache-2.0
// The axes, scale and place of the world that COLMAP has left open. y points down; with GPS x points east and z north, in metres.
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

/// Properties of a photo's camera by its file.
struct PhotoFacts {
    int orientation = 1;  // by EXIF, of the camera's pixels: 1 where these are upright
    std::optional<image::GpsFix> gps;
};

/// From COLMAP's world to the new one: x becomes scale * rotation * x + shift.
struct WorldAxes {
    double scale = 1;
    glm::dmat3 rotation{1};
    glm::dvec3 shift{0};
    std::optional<io::Place> place;  // of the new origin
    std::string text;                // a line for the user; empty: the axes did not change
};

/// facts: by the names of the photos. Those without are upright and have no GPS. The same input gives the same axes.
///
/// - Up: the direction perpendicular to the horizontal axes of the cameras, which people and gimbals hold level. Else their mean up
///   direction. For photos straight down, the opposite of their mean view.
/// - The ground: the plane with the most points, if most cameras are above it and its normal is near that direction. Without GPS it
///   levels the scene, since photos are tilted by some degrees.
/// - GPS: scale, heading and position by a robust fit of a similarity of the horizontal plane. A few photos with wrong GPS do not change it.
///   Altitudes level the scene if they determine that better than the cameras.
WorldAxes world_axes(const SparseModel& model, const std::map<std::string, PhotoFacts>& facts);

/// Moves the model in a folder into these axes, and writes the place into a file if it is known. photos: their folder, with the
/// model's names. Returns WorldAxes::text. Throws InputError where the model cannot be read, RunError.
std::string set_world_axes(const std::filesystem::path& model, const std::filesystem::path& photos,
                           const std::filesystem::path& place);

}  // namespace ewa::capture
