// SPDX-License-Identifier: Apache-2.0
// Finds training images that are blurred by camera motion or defocus.
#pragma once
#include <string>
#include <vector>

#include "ewa/dataset.h"

namespace ewa::train {

/// The frames whose image is blurred far more than most (image::blur_effect). Reads the images of all `frames`. Throws InputError.
std::vector<int> blurred_frames(const Dataset& dataset, const std::vector<int>& frames);

/// --skip-blurred: removes blurred_frames from the training frames. Returns a remark, or an empty text if none is blurred. Throws
/// InputError.
std::string skip_blurred(const Dataset& dataset, Split& split);

}  // namespace ewa::train
