// SPDX-License-Identifier: Apache-2.0
// The options for cameras that are not quite known: --refine-poses, --refine-focal, --rolling-shutter.
#pragma once
#include "ewa/run_options.h"
#include "run/run_option.h"

namespace ewa::train {

RunOption refine_poses_option();
RunOption refine_focal_option();
RunOption rolling_shutter_option();

/// The LensUse of a run. With --rolling-shutter, LensUse::automatic becomes native, because undistortion bends an image's rows,
/// which are read at one time.
LensUse lens_use(const RunOptions& options);

/// With --rolling-shutter: gives each frame without a readout one during which the camera does not move. Throws InputError.
void add_unknown_readouts(const RunOptions& options, Dataset& dataset);

}  // namespace ewa::train
