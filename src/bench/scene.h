// SPDX-License-Identifier: Apache-2.0
// Synthetic scenes: pure functions of a case, the same on every machine up to the last bits of log, cos and
// exp.
#pragma once
#include "bench/cases.h"
#include "ewa/camera.h"
#include "ewa/gaussians.h"
#include "ewa/image.h"

namespace ewa::bench {

struct Scene {
    Gaussians gaussians;
    Camera camera;
    Image photo;  // RGB in 256 levels; only for cases that train
};

/// Splats lie flat on ellipsoids before a backdrop. Their sizes are log-normal around the spacing that as
/// many splats leave each other on those surfaces, so that with more splats the surfaces become finer, not
/// thicker.
Scene make_scene(const Case& one);

}  // namespace ewa::bench
