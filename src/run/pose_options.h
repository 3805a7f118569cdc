// SPDX-License-Identifier: Apache-2.0
// The options for cameras that are not quite known: --refine-poses, --refine-focal, --rolling-shutter.
#pragma once
#include "ewa/run_options.h"
#include "run/run_option.h"

namespace ewa::train {

RunOption refine_poses_option();
RunOption refine_focal_option();
RunOption rolling_shutter_option();

/// The LensUse of a run. With --rolling-shutter `auto` becomes native, because undistortion bends the rows of an image.
LensUse lens_use(const RunOptions& options);

/// With --rolling-shutter: gives frames without a readout one in which their cameras are at rest. Throws InputError.
void add_unknown_readouts(const RunOptions& options, Dataset& dataset);

}  // namespace ewa::train
