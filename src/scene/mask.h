// SPDX-License-Identifier: Apache-2.0
// The files of a frame's image and mask.
#pragma once
#include <filesystem>

#include "ewa/image.h"

namespace ewa::scene {

/// As load_image. Also throws InputError where a value is not finite: it would make the loss and every gradient of its view not finite.
Image load_finite_image(const std::filesystem::path& path);

/// A mask as one channel, which is 1 where its image counts. The alpha of a mask is what counts if it is not the same everywhere. Values of
/// 0 and 1 out of 255 are 0 and 255, and one colour beside black is white. Throws InputError for other colours, and where the values
/// say that it is no mask.
Image load_mask(const std::filesystem::path& path);

/// The same of an image, turned as its pixels are stored. Throws InputError where it has another aspect ratio, also when EXIF's
/// orientation turns the image.
Image load_mask(const std::filesystem::path& path, const ImageSize& image);

/// The orientation that turns a mask of this size so. Throws InputError as load_mask.
int mask_turn(const std::filesystem::path& path, const ImageSize& mask, const ImageSize& image);

}  // namespace ewa::scene
