// SPDX-License-Identifier: Apache-2.0
// The bar at the upper border, the strip of tools at the left border of the picture, and the status line at the lower border.
#pragma once
#include "viewer/panel.h"

namespace ewa::viewer {

/// In px of the framebuffer: what the bars take of the window.
struct BarSizes {
    int top = 0, left = 0, bottom = 0;
};
BarSizes bar_sizes(double text_height);

void draw_bars(const WindowParts& parts);

}  // namespace ewa::viewer
