// SPDX-License-Identifier: Apache-2.0
// The places and the difference of a render and the image of the same camera. Independent of the window.
#pragma once
#include "viewer/byte_image.h"

namespace ewa::viewer {

enum class Comparison { none, beside, wipe, difference };

/// In pixels, from the top left corner.
struct Rectangle {
    int x = 0, y = 0, width = 0, height = 0;
    bool operator==(const Rectangle&) const = default;
};

/// The largest rectangle with the aspect ratio of `shape`, centred in `room`.
Rectangle fitted(Size shape, const Rectangle& room);

/// Places in the window. Beside: each gets half of the width right of `covered` px, or half of the whole
/// width if more than a third is covered. Otherwise the render fills the window, and the image the part that
/// its camera saw.
struct Arrangement {
    Rectangle rendering, image;
};
Arrangement arrange(Comparison comparison, Size window, Size image, int covered = 0);

/// |rendering - image| per channel, in the size of the render. The image fills `place` (px of the render) and
/// is sampled bilinearly; outside of it the result is black.
ByteImage difference(const ByteImage& rendering, const ByteImage& image, const Rectangle& place);
/// Multiplies every value by `gain`, up to 255.
void amplify(ByteImage& picture, float gain);

/// PSNR over the pixels of `place`, as psnr() computes it; NaN if the place is empty.
double psnr_of_difference(const ByteImage& difference, const Rectangle& place);

}  // namespace ewa::viewer
