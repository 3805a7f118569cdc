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
    glm::dvec3 readout_turn{0.0};  // during the readout: axis times angle, radians, camera axes
    /// A further shift of the centre during the readout, in world units along the axes of the moved camera at mid-readout.
    glm::dvec3 readout_shift{0.0};
    bool operator==(const CameraMotion&) const = default;
};

/// The camera after the motion. The angle of its turn during a readout is clamped to shared::READOUT_TURN_LEARNED radians.
Camera moved(const Camera& camera, const CameraMotion& motion);

/// The distance between two cameras of one image, at the middle of the readout.
struct CameraDistance {
    double degrees = 0;  // between their rotations
    double length = 0;   // between their centres, world units
    double focal = 1;    // factor of the focal length
};
/// Measures the change from camera `from` to camera `to`. CameraDistance::focal is fx of `to` divided by fx of `from`.
CameraDistance distance_between(const Camera& from, const Camera& to);

}  // namespace ewa
