// SPDX-License-Identifier: Apache-2.0
// An image as the window shows it: 8-bit RGBA. picture_of() converts renders and other images to this form.
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
    /// The value that white shows: a view z (world units) in modes of depth, a number of splats in count mode.
    float white = 0;
    /// The view z (world units) that the grey kDarkestDepth shows, in modes of depth.
    float dark = 0;
};

/// The grey of the nearest depth, from 0 to 1. It is not black, because black marks pixels without splats.
inline constexpr float kDarkestDepth = 0.1f;

/// Converts a render. Colours are clamped and rounded as save_image does for a PNG. Depth is black where no splat is.
/// Elsewhere its grey rises from kDarkestDepth at the 2nd percentile to white at the 98th. Only pixels that are at
/// least half opaque count for these percentiles. The count is shown by heat(), with white at its 99th percentile.
/// A normal's components from -1 to 1 become colours from 0 to 1. A pixel without a surface is black.
ByteImage picture_of(const Rendering& rendering, Mode mode);

/// Converts an RGB image, or an RGBA image that is blended over the background.
ByteImage picture_of(const Image& image, const std::array<float, 3>& background);

/// The RGB colour of a share. Shares from 0 to 1 go from black over red and yellow to white.
std::array<float, 3> heat(float share);

}  // namespace ewa::viewer
