// SPDX-License-Identifier: Apache-2.0
#include "pipeline/image_reader.h"

namespace ewa::pipeline {

Image ImageReader::image(uint32_t first, int count) const {
    Image image(int(sizes_.width), int(sizes_.height), count);
    for (size_t channel = 0; channel < size_t(count); ++channel)
        for (int y = 0; y < image.height; ++y) {
            const float* from = &planes_[(first + channel) * sizes_.plane_floats + size_t(y) * sizes_.stride];
            float* to = image.at(0, y) + channel;
            for (size_t x = 0; x < size_t(image.width); ++x) to[x * size_t(count)] = from[x];
        }
    return image;
}

}  // namespace ewa::pipeline
