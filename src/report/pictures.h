// SPDX-License-Identifier: Apache-2.0
// What a report shows of the pictures: file names, the error map, and data URIs.
#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "ewa/dataset.h"
#include "ewa/image.h"

namespace ewa::report {

/// Where each frame's picture goes, relative to the output folder, without extension: the image's stem, under
/// the subfolders in which the frames' names differ ("images/1.jpg", "images/2.jpg" -> "1", "2";
/// "left/1.jpg", "right/1.jpg" -> "left/1", "right/1"). Names never climb out of the folder, and no two are
/// the same: where stems collide (1.jpg beside 1.png) the whole file name is kept, and after that a number is
/// added.
std::vector<std::filesystem::path> picture_names(const std::vector<Frame>& frames);

/// |a - b| averaged over RGB, both clamped to [0, 1]; 0 dark to `full_scale` and above bright. Sizes must
/// agree.
Image error_map(const Image& a, const Image& b, double full_scale);

/// The largest |a - b| of a pixel's values, alpha too (1 where only one picture has it), not clamped; colours
/// as above. Values that are not finite are bright where the other's is not the same.
Image value_error_map(const Image& a, const Image& b, double full_scale);

std::string base64(const std::vector<unsigned char>& bytes);

/// The picture as an 8-bit PNG in a data URI, made smaller by a whole factor where it is wider than
/// max_width.
std::string data_uri(const Image& image, int max_width);

}  // namespace ewa::report
