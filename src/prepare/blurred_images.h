// SPDX-License-Identifier: Apache-2.0
// Training images that show less than the others because the camera or the focus moved.
#pragma once
#include <string>
#include <vector>

#include "ewa/dataset.h"

namespace ewa::train {

/// Those of the frames whose image is blurred far more than most (image::blur_effect). Reads all their images. Throws
/// InputError.
std::vector<int> blurred_frames(const Dataset& dataset, const std::vector<int>& frames);

/// --skip-blurred: takes those of the training frames out. Returns a remark, empty if there are none. Throws InputError.
std::string skip_blurred(const Dataset& dataset, Split& split);

}  // namespace ewa::train
