// SPDX-License-Identifier: Apache-2.0
// The gradient of the loss with respect to a camera's motion.
#pragma once
#include "ewa/camera_motion.h"

namespace ewa::reference {

/// dL/d(each value of a motion) from that of a motion which follows it.
CameraMotion motion_backward(const CameraMotion& motion, const CameraMotion& gradient);

}  // namespace ewa::reference
