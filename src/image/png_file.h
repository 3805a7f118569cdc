// SPDX-License-Identifier: Apache-2.0
// PNG through libpng itself. OpenImageIO's reader leaves libpng's messages on standard error, one for every
// colour profile that it does not like, and reads interlaced files whole before it gives a row.
#pragma once
#include <filesystem>
#include <functional>

#include "ewa/image.h"

namespace ewa::image {

struct PngPicture {
    ImageSize size;
    int channels = 0;           // grey, grey and alpha, RGB, RGBA; a palette is RGB or RGBA
    std::vector<float> values;  // of 8 bits / 255, of 16 bits / 65535
};

/// pixels: the values too. Colour spaces and other notes in the file are left alone, but for EXIF's
/// orientation. Throws InputError. The file has been looked at (format.h).
PngPicture read_png(const std::filesystem::path& path, bool pixels);

}  // namespace ewa::image
