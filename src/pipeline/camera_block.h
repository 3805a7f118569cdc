// SPDX-License-Identifier: Apache-2.0
// A camera as the shaders read it: float64 values in two floats each.
#pragma once
#include "ewa/camera.h"
#include "passes/shape.h"

namespace ewa::pipeline {

/// Throws InputError where a value is not finite, or a size or focal length is not positive.
shared::CameraBlock camera_block(const Camera& camera, const passes::Shape& shape,
                                 const glm::dvec3& origin = glm::dvec3(0));

}  // namespace ewa::pipeline
