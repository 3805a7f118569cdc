// SPDX-License-Identifier: Apache-2.0
#include "ewa/exposure.h"

namespace ewa {

Image exposed(Image picture, const Exposure& exposure) {
    for (size_t p = 0; p < picture.pixels.size(); p += size_t(picture.channels)) {
        float* color = &picture.pixels[p];
        const float r = color[0], g = color[1], b = color[2];
        for (size_t c = 0; c < 3; ++c)
            color[c] =
                exposure[4 * c] * r + exposure[4 * c + 1] * g + exposure[4 * c + 2] * b + exposure[4 * c + 3];
    }
    return picture;
}

}  // namespace ewa
