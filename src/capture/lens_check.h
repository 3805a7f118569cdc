// SPDX-License-Identifier: Apache-2.0
// Checks whether the lenses and poses that COLMAP has found are plausible for photos.
#pragma once
#include <cstddef>
#include <map>
#include <set>
#include <string>

#include "capture/sparse_model.h"
#include "ewa/camera.h"

namespace ewa::capture {

/// The reason why a lens is impossible; empty if it is possible. expected: the focal length by EXIF, px; 0: not known.
std::string lens_fault(const Camera& lens, double expected);

/// The quality of a model.
struct Grade {
    int placed = 0;  // photos
    int sound = 0;   // placed photos with a possible lens, and points in front of the camera
    int parted = 0;  // photos beyond a jump of the camera path, where the photos of one side may be wrong
    size_t contradictions = 0;                    // pairs of photos whose matches contradict their cameras
    double error = 0;                             // mean reprojection error over all observations, px
    std::map<std::string, std::string> faults{};  // of photos that are not sound, by name

    int credible() const { return sound - parted; }
    bool is_sound() const { return placed > 0 && sound == placed; }
};

/// The grade of a model. `contradictions` and `parted` stay 0, because they need matches, which the model does not contain.
/// expected: focal lengths by EXIF, px, by photo name.
Grade grade_of(const SparseModel& model, const std::map<std::string, double>& expected);

/// Whether the first model is better. Criteria, in order: more sound photos (credible ones, if both have nearly as many sound),
/// more photos, fewer contradictions, a smaller error. Observations do not count: wrongly placed photos have some, too.
bool is_better(const Grade& first, const Grade& second);

/// Whether the model has so many of the photos that COLMAP need not try other settings.
bool is_enough(const Grade& grade, size_t photos);

}  // namespace ewa::capture
