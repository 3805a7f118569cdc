// SPDX-License-Identifier: Apache-2.0
// Image files beyond include/ewa/image.h: bytes in memory, formats, and the images of a folder.
#pragma once
#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "ewa/image.h"

namespace ewa::image {

/// The PNG or JPEG that these bytes hold, as load_image returns it. Throws InputError that begins with
/// `what`, also for any other format, and for more than `largest` pixels in a direction.
Image decode(std::span<const unsigned char> bytes, const std::string& what, int largest);

/// The bytes of a PNG of 1 to 4 channels and 8 bits: clamped to [0, 1], rounded, NaN as 0. Throws RunError.
std::vector<unsigned char> encode_png(const Image& image);

/// What the file's first bytes say: png, jpeg, tiff, openexr, webp, bmp, pnm or hdr. Throws InputError for
/// any other file.
std::string_view format_name(const std::filesystem::path& path);

/// The files below a folder and its subfolders whose extension is one of an image, relative to the folder and
/// sorted. Links to folders are not followed. Throws InputError where a folder cannot be read.
std::vector<std::filesystem::path> images_below(const std::filesystem::path& folder);

}  // namespace ewa::image
