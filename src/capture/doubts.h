// SPDX-License-Identifier: Apache-2.0
// Finds signs of wrong cameras that the reprojection errors of points do not show.
#pragma once
#include <filesystem>
#include <glm/vec2.hpp>
#include <string>
#include <utility>
#include <vector>

#include "capture/feature_database.h"
#include "capture/lens_check.h"
#include "capture/sparse_model.h"

namespace ewa::capture {

/// Whether the matches of two photos contradict their cameras: most are far from their epipolar lines. matches: px in both.
bool contradict(const Camera& first, const Camera& second,
                const std::vector<std::pair<glm::dvec2, glm::dvec2>>& matches);

/// Two photos whose matches contradict their cameras.
struct Contradiction {
    std::string first, second;
    size_t matches = 0;
    bool follows = false;  // the photos are at most two apart in the order of names
};

/// The pairs of photos with many matches that contradict their cameras. The database must number the images as the model does.
std::vector<Contradiction> contradictions_in(const SparseModel& model, const FeatureDatabase& database);

/// The camera of a photo.
struct Station {
    std::string name;
    glm::dvec3 center{0};
    glm::dmat3 rotation{1};  // world to camera
};

/// Names of photos whose cameras are far from, or turned against, those of the photos before and after, if these two are near each
/// other. Empty unless most successive cameras are near each other. stations: in the order in which the photos were taken.
std::vector<std::string> strays_among(const std::vector<Station>& stations);

/// Indices of photos that have many matches with the next photo, although the two cameras are much farther apart or turned than
/// others. Empty unless most successive cameras are near each other. matches: of each station with the next one.
std::vector<size_t> jumps_among(const std::vector<Station>& stations, const std::vector<size_t>& matches);
/// The number of photos outside the longest part of the camera path without a jump. jumps: as jumps_among() gives them.
size_t parted_by(const std::vector<size_t>& jumps, size_t stations);
/// The verified matches of each station with the next one.
std::vector<size_t> matches_along(const std::vector<Station>& stations, const FeatureDatabase& database);

/// The stations of a model's photos in the order of names.
std::vector<Station> stations_of(const SparseModel& model);

/// Lines for the user about cameras that are probably wrong. Empty: none are found. jumps: texts with both photos.
std::vector<std::string> doubts_of(const Grade& grade, const std::vector<Contradiction>& contradictions,
                                   const std::vector<std::string>& strays,
                                   const std::vector<std::string>& jumps);

}  // namespace ewa::capture
