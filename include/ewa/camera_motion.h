// SPDX-License-Identifier: Apache-2.0
// A small motion of a camera, as training with TrainOptions::refine_poses learns it.
#pragma once
#include "ewa/camera.h"

namespace ewa {

/// The motion (w, s, f) of a camera with rotation W and centre e. The moved camera has the rotation exp(w) W, the centre e + W^T s, and
/// exp(f) times the focal lengths. W and e of a rolling shutter are those of the middle of the readout. During the readout, the
/// camera turns by `readout_turn` more, and its centre moves by `readout_shift` more. Global shutters ignore these two.
struct CameraMotion {
    glm::dvec3 rotation{0.0};      // w: axis times angle, radians, camera axes
    double log_focal = 0;          // f
    glm::dvec3 shift{0.0};         // s: world units, along the camera's axes before the motion
    glm::dvec3 readout_turn{0.0};  // radians, camera axes
    /// How much further the camera moves from the first row's readout to the last one's: world units, along the axes of the moved
    /// camera at the middle of the readout.
    glm::dvec3 readout_shift{0.0};
    bool operator==(const CameraMotion&) const = default;
};

/// The camera after the motion. The turn of a readout is clamped to shared::READOUT_TURN_LEARNED.
Camera moved(const Camera& camera, const CameraMotion& motion);

/// The distance between two cameras of one image, at the middle of the readout.
struct CameraDistance {
    double degrees = 0;  // between their rotations
    double length = 0;   // between their centres, world units
    double focal = 1;    // factor of the focal length
};
/// focal: that of `to` divided by that of `from`, by fx.
CameraDistance distance_between(const Camera& from, const Camera& to);

}  // namespace ewa
