// SPDX-License-Identifier: Apache-2.0
// Whether the lenses and the poses that a search has found can be those of photos.
#pragma once
#include <cstddef>
#include <map>
#include <set>
#include <string>

#include "capture/sparse_model.h"
#include "ewa/camera.h"

namespace ewa::capture {

/// Why no lens of a camera is like this; empty if one may be. expected: the focal length by EXIF, px; 0: not known.
std::string lens_fault(const Camera& lens, double expected);

/// The quality of a model.
struct Grade {
    int placed = 0;  // photos
    int sound = 0;   // of them: no fault of the lens, points in front of the camera
    int parted = 0;  // photos beyond a jump of the path: right, or they and those before the jump are not
    size_t contradictions = 0;                    // pairs of photos whose matches do not fit their cameras
    double error = 0;                             // of the points, px, the mean over their observations
    std::map<std::string, std::string> faults{};  // of the others, by name

    int credible() const { return sound - parted; }
    bool is_sound() const { return placed > 0 && sound == placed; }
};

/// Without contradictions and parted photos, which the model does not know. expected: focal lengths by EXIF by the photos' names, px.
Grade grade_of(const SparseModel& model, const std::map<std::string, double>& expected);

/// Whether the first model is worth more: it has more sound photos, or more credible ones if the other has nearly as many, else more photos, else fewer contradictions, else a smaller
/// error. More observations say nothing: those of a photo in a wrong place count, too.
bool is_better(const Grade& first, const Grade& second);

/// Whether so many photos are so many that no other way is tried.
bool is_enough(const Grade& grade, size_t photos);

}  // namespace ewa::capture
