// SPDX-License-Identifier: Apache-2.0
// Whether the intrinsics of a camera are plausible.
#pragma once
#include <string>

#include "ewa/camera.h"

namespace ewa::scene {

/// The reason why intrinsics cannot be those of a real camera, such as a focal length of 1e30 or a principal point far outside of
/// the image. Empty if they can. The camera's width and height must be above 0.
std::string intrinsics_fault(const Camera& camera, const Distortion& lens);

}  // namespace ewa::scene
