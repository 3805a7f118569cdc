// SPDX-License-Identifier: Apache-2.0
// Whether the numbers of a camera can be those of a camera.
#pragma once
#include <string>

#include "ewa/camera.h"

namespace ewa::scene {

/// The reason why intrinsics are those of no camera: a focal length or a distortion of 1e30, or a principal point a long way outside
/// the image. Empty for others. The camera has a size.
std::string intrinsics_fault(const Camera& camera, const Distortion& lens);

}  // namespace ewa::scene
