// SPDX-License-Identifier: Apache-2.0
// The bar at the upper border, the strip of tools at the left border of the picture, and the status line at the lower border.
#pragma once
#include "viewer/panel.h"

namespace ewa::viewer {

void draw_bars(const WindowParts& parts);

}  // namespace ewa::viewer
