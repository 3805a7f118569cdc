// SPDX-License-Identifier: Apache-2.0
// The files of a frame's image and mask.
#pragma once
#include <filesystem>

#include "ewa/image.h"

namespace ewa::scene {

/// Reads an image as load_image does. Also throws InputError if a value is not finite, since loss and gradients of its view would
/// not be finite either.
Image load_finite_image(const std::filesystem::path& path);

/// A mask as one channel, which is 1 where its image counts. If the file's alpha varies, it is the mask. If all values are 0 or 1
/// out of 255, 1 counts as white. So does the only colour of a mask that has one colour besides black. Throws InputError for other
/// colours and other values.
Image load_mask(const std::filesystem::path& path);

/// The mask of an image, turned as the image's pixels are stored. Throws InputError where it has another aspect ratio, also when EXIF's
/// orientation turns the image.
Image load_mask(const std::filesystem::path& path, const ImageSize& image);

/// The EXIF orientation that turns a mask of this size to the image's stored pixels. Throws InputError as load_mask.
int mask_turn(const std::filesystem::path& path, const ImageSize& mask, const ImageSize& image);

}  // namespace ewa::scene
