// SPDX-License-Identifier: Apache-2.0
#include "reference/exposure.h"

#include <cassert>

namespace ewa::reference {

Raster exposed(const Raster& picture, const Exposure& e) {
    Raster out(picture.width, picture.height, 3);
    for (int y = 0; y < picture.height; ++y)
        for (int x = 0; x < picture.width; ++x) {
            const double* c = picture.at(x, y);
            for (size_t row = 0; row < 3; ++row)
                out.at(x, y)[row] =
                    e[4 * row] * c[0] + e[4 * row + 1] * c[1] + e[4 * row + 2] * c[2] + e[4 * row + 3];
        }
    return out;
}

ExposureGradient exposed_backward(const Raster& picture, const Exposure& e, const Raster& gradient) {
    assert(picture.width == gradient.width && picture.height == gradient.height);
    ExposureGradient out{Raster(picture.width, picture.height, 3), {}};
    for (int y = 0; y < picture.height; ++y)
        for (int x = 0; x < picture.width; ++x)
            for (size_t row = 0; row < 3; ++row) {
                const double g = gradient.at(x, y)[row];
                for (size_t k = 0; k < 3; ++k) {
                    out.picture.at(x, y)[k] += g * e[4 * row + k];
                    out.exposure[4 * row + k] += g * picture.at(x, y)[k];
                }
                out.exposure[4 * row + 3] += g;
            }
    return out;
}

}  // namespace ewa::reference
