// SPDX-License-Identifier: Apache-2.0
#include "pathtracer/develop.h"

#include <algorithm>
#include <cmath>

namespace ewa::pathtracer {

float developed(double value) {
    if (!(value > 0)) return 0;
    const double v = std::min(value, 1.0);
    return float(v <= 0.0031308 ? 12.92 * v : 1.055 * std::pow(v, 1 / 2.4) - 0.055);
}

Image develop(const Image& radiance, double factor) {
    bool whole = true;
    for (size_t i = 3; i < radiance.pixels.size(); i += 4) whole = whole && radiance.pixels[i] >= 1;
    Image image(radiance.width, radiance.height, whole ? 3 : 4);
    for (size_t i = 0; i < radiance.pixels.size() / 4; ++i) {
        const float* from = &radiance.pixels[4 * i];
        float* to = &image.pixels[size_t(image.channels) * i];
        for (int c = 0; c < 3; ++c)
            to[c] = from[3] > 0 ? developed(double(from[c]) / double(from[3]) * factor) : 0.0f;
        if (!whole) to[3] = from[3];
    }
    return image;
}

double automatic_exposure(const std::vector<Image>& radiances) {
    std::vector<float> values;
    for (const Image& image : radiances)
        for (size_t i = 0; i < image.pixels.size(); i += 4) {
            const float* pixel = &image.pixels[i];
            if (pixel[3] >= 0.5f) values.push_back(std::max({pixel[0], pixel[1], pixel[2]}) / pixel[3]);
        }
    if (values.empty()) return 0;
    const auto place = values.begin() + std::ptrdiff_t(double(values.size() - 1) * 0.95);
    std::nth_element(values.begin(), place, values.end());
    if (!(*place > 0)) return 0;
    return std::round(10 * std::log2(0.8 / double(*place))) / 10;
}

}  // namespace ewa::pathtracer
