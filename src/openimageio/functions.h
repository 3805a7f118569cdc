// SPDX-License-Identifier: Apache-2.0
// The functions of image/openimageio.h, one file each.
#pragma once
#include "image/openimageio.h"

namespace ewa::openimageio {

image::StoredPicture read(const std::string& path, image::Format format, bool pixels);
std::vector<unsigned char> encode_png(int width, int height, int channels, const uint8_t* values);
std::vector<unsigned char> encode_exr(int width, int height, int channels, const float* values);
ImageDifference compare(const Image& a, const Image& b, double tolerance);

}  // namespace ewa::openimageio
