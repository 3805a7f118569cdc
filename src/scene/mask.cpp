// SPDX-License-Identifier: Apache-2.0
#include "scene/mask.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <set>
#include <string>

#include "core/text.h"
#include "ewa/error.h"
#include "image/image_files.h"

namespace ewa::scene {

namespace {

using Color = std::array<float, 3>;

Image channel_of(const Image& image, int channel) {
    Image result(image.width, image.height, 1);
    for (size_t i = 0; i < result.pixels.size(); ++i)
        result.pixels[i] = image.pixels[i * size_t(image.channels) + size_t(channel)];
    return result;
}

bool is_constant(const Image& image) {
    return std::ranges::all_of(image.pixels, [&](float value) { return value == image.pixels[0]; });
}

/// White where the image is not black. Empty unless it has one other colour. Palettes give objects such colours.
Image of_one_color(const Image& image) {
    std::set<Color> colors;
    Image result(image.width, image.height, 1);
    for (size_t i = 0; i < result.pixels.size(); ++i) {
        const float* p = &image.pixels[i * size_t(image.channels)];
        result.pixels[i] = p[0] > 0 || p[1] > 0 || p[2] > 0 ? 1.0f : 0.0f;
        if (result.pixels[i] > 0) colors.insert({p[0], p[1], p[2]});
        if (colors.size() > 1) return {};
    }
    return result;
}

bool is_grey(const Image& image) {
    constexpr float kNoise = 0.15f;  // of JPEG
    for (size_t i = 0; i < image.pixels.size(); i += size_t(image.channels)) {
        const auto [low, high] = std::minmax({image.pixels[i], image.pixels[i + 1], image.pixels[i + 2]});
        if (high - low > kNoise) return false;
    }
    return true;
}

/// Programs that number objects write 1 where others write white.
void stretch(Image& mask, const std::filesystem::path& path) {
    constexpr float kEight = 255, kSixteen = 65535, kFewest = 16;  // levels
    constexpr double kObject = 0.02;  // of the pixels: less may be the rest of a soft border
    const std::string_view format = image::format_name(path);
    // Lossy files have noise, and floating-point ones are exact.
    if (format != "png" && format != "tiff" && format != "bmp" && format != "pnm") return;
    const float largest = *std::ranges::max_element(mask.pixels);
    const float levels = read_image_size(path).eight_bit ? kEight : kSixteen;
    const float white = std::round(largest * levels);
    if (white > kEight || white < 1 || (levels == kEight && white >= kFewest)) return;
    const auto seen = std::ranges::count_if(mask.pixels, [](float value) { return value > 0; });
    if (white > 1 && white<kFewest&& double(seen)> kObject * double(mask.pixels.size()))
        throw InputError(core::one_line(path.string()) + ": the mask's largest value is " +
                         std::to_string(int(white)) +
                         ", which is almost black; a mask is white where its image counts");
    if (white > 1 && white < kFewest) return;
    for (float& value : mask.pixels) value *= levels / (white == 1 ? 1 : kEight);
}

}  // namespace

Image load_finite_image(const std::filesystem::path& path) {
    Image image = load_image(path);
    const auto bad = std::ranges::find_if(image.pixels, [](float value) { return !std::isfinite(value); });
    if (bad == image.pixels.end()) return image;
    const auto pixel = (bad - image.pixels.begin()) / image.channels;
    throw InputError(core::one_line(path.string()) + ": the pixel at column " +
                     std::to_string(pixel % image.width) + ", row " + std::to_string(pixel / image.width) +
                     " holds a value that is not finite; replace it by a number, or remove the image");
}

Image load_mask(const std::filesystem::path& path) {
    const Image image = load_finite_image(path);
    if (image.channels == 4)
        if (Image alpha = channel_of(image, 3); !is_constant(alpha)) {
            stretch(alpha, path);
            return alpha;
        }
    if (is_grey(image)) {
        Image mask = channel_of(image, 0);
        stretch(mask, path);
        return mask;
    }
    Image mask = of_one_color(image);
    if (mask.pixels.empty())
        throw InputError(core::one_line(path.string()) +
                         ": the mask has colours; a mask is grey, and white where its image counts");
    return mask;
}

}  // namespace ewa::scene
