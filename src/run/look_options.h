// SPDX-License-Identifier: Apache-2.0
// The options of a training that say how splats are drawn.
#pragma once
#include "run/run_option.h"

namespace ewa::train {

RunOption background_option();
RunOption points_option();
RunOption nearest_option();
RunOption integrator_option();

}  // namespace ewa::train
