// SPDX-License-Identifier: Apache-2.0
// A small motion of a camera, as training with TrainOptions::refine_poses learns it.
#pragma once
#include "ewa/camera.h"

namespace ewa {

/// The motion (w, s, f) of a camera with rotation W, centre e and focal lengths: exp(w) W, e + W^T s, exp(f) times the
/// focal lengths.
struct CameraMotion {
    glm::dvec3 rotation{0.0};  // w: axis times angle, radians, camera axes
    double log_focal = 0;      // f
    glm::dvec3 shift{0.0};     // s: world units, along the camera's axes before the motion
    bool operator==(const CameraMotion&) const = default;
};

Camera moved(const Camera& camera, const CameraMotion& motion);

/// How far a camera is from another one of the same image.
struct CameraDistance {
    double degrees = 0;  // between their rotations
    double length = 0;   // between their centres, world units
    double focal = 1;    // factor of the focal length
};
CameraDistance distance_between(const Camera& from, const Camera& to);

}  // namespace ewa
