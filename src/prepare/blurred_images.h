// SPDX-License-Identifier: Apache-2.0
// Training images that show less than the others because the camera or the focus moved.
#pragma once
#include <string>
#include <vector>

#include "ewa/dataset.h"
#include "ewa/run_options.h"

namespace ewa::train {

/// Those of the frames whose image is blurred far more than most (image::blur_effect). Reads all their images. Throws
/// InputError.
std::vector<int> blurred_frames(const Dataset& dataset, const std::vector<int>& frames);

/// --skip-blurred and --weigh-blurred: takes those of the training frames out, or lets them count less in the loss. Returns a
/// remark, empty if there are none. Throws InputError.
std::string handle_blurred(Dataset& dataset, Split& split, const RunOptions& options);

/// Lets the pixels of a training frame count as much as the weights say, one channel from 0 to 1 of any size.
void weigh_pixels(Frame& frame, Image weights, const TrainOptions& options);

}  // namespace ewa::train
