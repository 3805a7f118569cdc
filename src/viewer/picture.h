// SPDX-License-Identifier: Apache-2.0
// A rendering as the window shows it: 8 bit RGBA.
#pragma once
#include <array>
#include <cstdint>
#include <vector>

#include "ewa/renderer.h"

namespace ewa::viewer {

enum class Mode { color, depth, opacity };

struct Picture {
    int width = 0, height = 0;
    std::vector<uint8_t> rgba;
    float white_depth = 0;  // in depth mode: the view z that is shown white, world units
};

/// `rendering` is in front of black, and has a depth when the mode is depth. Rounded and clamped as
/// save_image does for a PNG. Depth is divided by its 98th percentile over what is at least half opaque, so
/// that a few far splats do not turn everything else black; it is black where nothing is.
Picture picture_of(const Rendering& rendering, Mode mode, const std::array<float, 3>& background);

}  // namespace ewa::viewer
