// SPDX-License-Identifier: Apache-2.0
// Whether a PNG or JPEG file is whole. The codecs either print their complaints on standard error (libpng) or
// fill what is missing with grey (libjpeg); a photograph that is cut off has to be an error, and only one
// line of it.
#pragma once
#include <filesystem>

namespace ewa::image {

/// Throws InputError where a PNG's chunks do not reach to its end or, with `checksums`, one's checksum is
/// wrong. Files of another kind pass.
void check_png(const std::filesystem::path& path, bool checksums);

/// Throws InputError where a JPEG file ends before its end-of-image marker. Files of another kind pass.
void check_jpeg(const std::filesystem::path& path);

}  // namespace ewa::image
