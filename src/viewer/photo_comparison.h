// SPDX-License-Identifier: Apache-2.0
// The photograph of a camera against the splats seen through it. Knows nothing of windows.
#pragma once
#include "viewer/picture.h"
#include "viewer/size.h"

namespace ewa::viewer {

enum class Comparison { none, beside, wipe, difference };

/// Pixels of the window, from its top left corner.
struct Rectangle {
    int x = 0, y = 0, width = 0, height = 0;
    bool operator==(const Rectangle&) const = default;
};

/// The largest rectangle of the shape of `shape` in the middle of `room`.
Rectangle fitted(Size shape, const Rectangle& room);

/// Where the rendering and the photograph stand in the window. Beside each other: a half each of what is
/// right of `covered` px, of all of it where they are more than a third. Otherwise the rendering has all of
/// it, and the photograph the part that its camera saw.
struct Arrangement {
    Rectangle rendering, photograph;
};
Arrangement arrange(Comparison comparison, Size window, Size photograph, int covered = 0);

/// |rendering - photograph| per channel, in the size of the rendering; the photograph stands in `place` (px
/// of the rendering) and is sampled bilinearly, beyond it the result is black.
Picture difference(const Picture& rendering, const Picture& photograph, const Rectangle& place);
/// Every value times `gain`, as far as 255.
void amplify(Picture& picture, float gain);

/// Over the pixels of `place`, as psnr() has it; NaN where the place is empty.
double psnr_of_difference(const Picture& difference, const Rectangle& place);

}  // namespace ewa::viewer
