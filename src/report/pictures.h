// SPDX-License-Identifier: Apache-2.0
// File names of renders, and error maps.
#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "ewa/dataset.h"
#include "ewa/image.h"

namespace ewa::report {

/// The path of each frame's render, relative to the output folder and without extension. It is the stem of
/// the image below the subfolders in which the names differ: "images/1.jpg", "images/2.jpg" -> "1", "2";
/// "left/1.jpg", "right/1.jpg" -> "left/1", "right/1". All paths stay inside the folder and differ: equal
/// stems (1.jpg, 1.png) keep their extension, then a number is added.
std::vector<std::filesystem::path> picture_names(const std::vector<Frame>& frames);

/// |a - b| averaged over RGB, both clamped to [0, 1], from dark (0) to bright (`full_scale` or more). The
/// sizes must be equal.
Image error_map(const Image& a, const Image& b, double full_scale);

/// The largest |a - b| of a pixel's values, not clamped, in the same colours. Alpha counts too; it is 1 where
/// only one image has it. A value that is not finite is brightest, unless both are equal.
Image value_error_map(const Image& a, const Image& b, double full_scale);

}  // namespace ewa::report
