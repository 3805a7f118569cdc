// SPDX-License-Identifier: Apache-2.0
// A camera as the shaders read it: each float64 value in two floats.
#pragma once
#include "ewa/camera.h"
#include "passes/kernel_config.h"

namespace ewa::pipeline {

/// origin: of the scene's means, world units. Throws InputError if a value is not finite, or a size or focal
/// length is not positive.
shared::CameraBlock camera_block(const Camera& camera, const passes::KernelConfig& config,
                                 const glm::dvec3& origin = glm::dvec3(0));

}  // namespace ewa::pipeline
