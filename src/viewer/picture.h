// SPDX-License-Identifier: Apache-2.0
// A rendering as the window shows it: 8 bit RGBA.
#pragma once
#include <array>
#include <cstdint>
#include <vector>

#include "ewa/renderer.h"

namespace ewa::viewer {

enum class Mode { color, depth, opacity, count, ellipsoids };

/// What is to be drawn for a mode.
Drawing drawing_for(Mode mode);

struct Picture {
    int width = 0, height = 0;
    std::vector<uint8_t> rgba;
    /// What white stands for: a view z (world units) in depth mode, a number of splats in count mode.
    float white = 0;
    /// The view z that kDarkestDepth stands for, in depth mode.
    float dark = 0;
};

/// The grey of the nearest depth, so that what is near is not what is not there.
inline constexpr float kDarkestDepth = 0.1f;

/// Rounded and clamped as save_image does for a PNG. Depth goes from kDarkestDepth at its 2nd percentile to
/// white at its 98th, both over what is at least half opaque, so that a few splats far off or before the
/// camera do not take the contrast from the rest; it is black where nothing is. The count goes from black
/// over red and yellow to white at its 99th percentile.
Picture picture_of(const Rendering& rendering, Mode mode);

/// RGB, or RGBA whose alpha is blended over the background.
Picture picture_of(const Image& image, const std::array<float, 3>& background);

/// Black over red and yellow to white, for 0 to 1.
std::array<float, 3> heat(float share);

}  // namespace ewa::viewer
