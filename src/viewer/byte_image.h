// SPDX-License-Identifier: Apache-2.0
// An image as the window shows it: 8-bit RGBA. Converts renders and images to it.
#pragma once
#include <array>
#include <cstdint>
#include <vector>

#include "ewa/renderer.h"

namespace ewa::viewer {

enum class Mode { color, depth, opacity, count, ellipsoids, median_depth, normal };
inline constexpr int kModes = int(Mode::normal) + 1;

/// Width and height in px.
struct Size {
    int width = 0, height = 0;
    bool operator==(const Size&) const = default;
};

struct ByteImage {
    int width = 0, height = 0;
    std::vector<uint8_t> rgba;
    /// The value of white: a view z (world units) in modes of depth, a number of splats in count mode.
    float white = 0;
    /// The view z of kDarkestDepth, in modes of depth.
    float dark = 0;
};

/// The grey of the nearest depth. Black means that there is no splat.
inline constexpr float kDarkestDepth = 0.1f;

/// Clamps and rounds as save_image does for a PNG. Depth goes from kDarkestDepth at its 2nd percentile to white
/// at its 98th. Both are taken over pixels that are at least half opaque, so that a few outliers do not reduce
/// the contrast. Depth is black where there is no splat. The count goes from black over red and yellow to white
/// at its 99th percentile. A normal's -1 to 1 become 0 to 1, and no surface is black.
ByteImage picture_of(const Rendering& rendering, Mode mode);

/// Converts RGB, or RGBA blended over the background.
ByteImage picture_of(const Image& image, const std::array<float, 3>& background);

/// The colour of 0 to 1: from black over red and yellow to white.
std::array<float, 3> heat(float share);

}  // namespace ewa::viewer
