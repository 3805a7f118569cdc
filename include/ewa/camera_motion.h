// SPDX-License-Identifier: Apache-2.0
// A small motion of a camera, as training with TrainOptions::refine_poses learns it.
#pragma once
#include "ewa/camera.h"

namespace ewa {

/// The motion (w, s, f) of a camera with rotation W, centre e and focal lengths: exp(w) W, e + W^T s, exp(f) times the
/// focal lengths. W and e of a rolling shutter are those of the middle of the readout. During the readout, the camera turns by
/// `readout_turn` more, and its centre moves by `readout_shift` more. These two do nothing with a global shutter.
struct CameraMotion {
    glm::dvec3 rotation{0.0};      // w: axis times angle, radians, camera axes
    double log_focal = 0;          // f
    glm::dvec3 shift{0.0};         // s: world units, along the camera's axes before the motion
    glm::dvec3 readout_turn{0.0};  // radians, camera axes
    glm::dvec3 readout_shift{
        0.0};  // world units, along the axes of the moved camera at the middle of the readout
    bool operator==(const CameraMotion&) const = default;
};

/// The turn of a readout is at most shared::READOUT_TURN_LEARNED.
Camera moved(const Camera& camera, const CameraMotion& motion);

/// How far a camera is from another one of the same image, at the middle of the readout.
struct CameraDistance {
    double degrees = 0;  // between their rotations
    double length = 0;   // between their centres, world units
    double focal = 1;    // factor of the focal length
};
CameraDistance distance_between(const Camera& from, const Camera& to);

}  // namespace ewa
