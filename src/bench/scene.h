// SPDX-License-Identifier: Apache-2.0
// Synthetic scenes: pure functions of a case. They are equal on all machines up to the last bits of log, cos
// and exp.
#pragma once
#include "bench/cases.h"
#include "ewa/camera.h"
#include "ewa/gaussians.h"
#include "ewa/image.h"

namespace ewa::bench {

struct BenchScene {
    Gaussians gaussians;
    Camera camera;
    Image photo;  // RGB in 256 levels; only for cases that train
};

/// Splats lie flat on ellipsoids before a backdrop. Their sizes are log-normal around their spacing on these
/// surfaces. So more splats make the surfaces finer, not thicker.
BenchScene make_scene(const Case& one);

}  // namespace ewa::bench
