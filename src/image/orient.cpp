// SPDX-License-Identifier: Apache-2.0
#include <cassert>

#include "ewa/image.h"

namespace ewa {

Image oriented(const Image& image, int orientation) {
    assert(orientation >= 1 && orientation <= 8);
    if (orientation == 1) return image;
    // EXIF 2.32, tag 274: where the first row and the first column of the stored picture lie in the upright
    // one.
    const bool swapped = orientation >= 5;
    const bool from_right = orientation == 2 || orientation == 3 || orientation == 7 || orientation == 8;
    const bool from_bottom = orientation == 3 || orientation == 4 || orientation == 6 || orientation == 7;
    Image result(swapped ? image.height : image.width, swapped ? image.width : image.height, image.channels);
    for (int y = 0; y < result.height; ++y)
        for (int x = 0; x < result.width; ++x) {
            const int column = swapped ? y : x, row = swapped ? x : y;
            const float* from = image.at(from_right ? image.width - 1 - column : column,
                                         from_bottom ? image.height - 1 - row : row);
            for (int c = 0; c < image.channels; ++c) result.at(x, y)[c] = from[c];
        }
    return result;
}

}  // namespace ewa
