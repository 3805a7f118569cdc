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

/// The reason why a lens is impossible; empty if it is possible. expected: the focal length by EXIF, px; 0: not known.
std::string lens_fault(const Camera& lens, double expected);

/// The quality of a model.
struct Grade {
    int placed = 0;  // photos
    int sound = 0;   // of these: the lens is possible, and the points are in front of the camera
    int parted = 0;  // photos beyond a jump of the path: the jump is real, or one side of it is wrong
    size_t contradictions = 0;                    // pairs of photos whose matches contradict their cameras
    double error = 0;                             // mean reprojection error over all observations, px
    std::map<std::string, std::string> faults{};  // of photos that are not sound, by name

    int credible() const { return sound - parted; }
    bool is_sound() const { return placed > 0 && sound == placed; }
};

/// The grade of a model, without contradictions and parted photos, which it does not contain. expected: focal lengths by EXIF, px, by
/// the photos' names.
Grade grade_of(const SparseModel& model, const std::map<std::string, double>& expected);

/// Whether the first model is better: it has more sound photos, or more credible ones if the other has nearly as many. Else it has more
/// photos, fewer contradictions or a smaller error. The number of observations is no criterion: wrongly placed photos have some, too.
bool is_better(const Grade& first, const Grade& second);

/// Whether enough of the photos are placed, so that no other way is tried.
bool is_enough(const Grade& grade, size_t photos);

}  // namespace ewa::capture
