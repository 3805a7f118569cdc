// SPDX-License-Identifier: Apache-2.0
// The files of a frame's image and mask.
#pragma once
#include <filesystem>

#include "ewa/image.h"

namespace ewa::scene {

/// As load_image. Also throws InputError where a value is not finite: it would make the loss and every gradient of its view not finite.
Image load_finite_image(const std::filesystem::path& path);

/// A mask as one channel, which is 1 where its image counts. The alpha of a mask is what counts if it is not the same everywhere. Values of
/// 0 and 1 out of 255 are 0 and 255, and one colour beside black is white. Throws InputError for other colours, and where the largest
/// value says that it is no mask.
Image load_mask(const std::filesystem::path& path);

}  // namespace ewa::scene
