// SPDX-License-Identifier: Apache-2.0
#include "scene/mask.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <set>
#include <string>
#include <vector>

#include "core/text.h"
#include "ewa/error.h"
#include "image/image_files.h"
#include "scene/camera.h"

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

/// What a mask's pixels are, as levels of the file.
struct Levels {
    std::vector<char> there, flat;  // by level above 0: some pixel has it, and one with equal neighbours
    size_t near = 0, far = 0;       // neighbours whose levels differ by one level, and by more
};

Levels levels_of(const Image& mask, float levels) {
    Levels found{std::vector<char>(size_t(levels) + 1), std::vector<char>(size_t(levels) + 1)};
    const auto level = [&](int x, int y) {
        return size_t(std::clamp(std::round(*mask.at(x, y) * levels), 0.0f, levels));
    };
    for (int y = 0; y < mask.height; ++y)
        for (int x = 0; x < mask.width; ++x) {
            const size_t here = level(x, y);
            bool flat = mask.width > 1 && mask.height > 1;
            for (const auto& [i, k] : {std::pair(x - 1, y), {x, y - 1}, {x + 1, y}, {x, y + 1}}) {
                if (i < 0 || k < 0 || i >= mask.width || k >= mask.height) continue;
                const size_t other = level(i, k);
                if (other == here) continue;
                flat = false;
                ++((std::max(here, other) - std::min(here, other) == 1) ? found.near : found.far);
            }
            found.there[here] = 1;
            if (flat) found.flat[here] = 1;
        }
    found.there[0] = found.flat[0] = 0;
    return found;
}

/// Whether the values number objects: most of them fill regions, whose borders are hard. A soft mask has values that are only at
/// borders, or it changes slowly. One value is a weight if it is a half, or nearly white. white: the largest level. large: of a part of
/// the image that is no rest of a border.
bool numbers_objects(const Image& mask, float levels, float white, bool large) {
    constexpr float kSlow = 32, kNearWhite = 200.0f / 255;
    constexpr std::ptrdiff_t kMany = 4;  // regions
    const Levels found = levels_of(mask, levels);
    const auto there = std::ranges::count(found.there, 1), flat = std::ranges::count(found.flat, 1);
    const float half = std::floor(levels / 2);
    if (2 * flat <= there || (there == 1 && (white == half || white == half + 1))) return false;
    if (white >= kNearWhite * levels && flat < kMany) return false;
    return (large && white < kSlow) || found.near < found.far;
}

/// Programs that number objects write 1 where others write white.
void stretch(Image& mask, const std::filesystem::path& path) {
    constexpr float kEight = 255, kSixteen = 65535, kFewest = 16;  // levels
    constexpr double kObject = 0.02;  // of the pixels: less may be the rest of a soft border
    const std::string_view format = image::format_name(path);
    // Lossy files have noise, and floating-point ones are exact.
    if (format != "png" && format != "tiff" && format != "bmp" && format != "pnm") return;
    const float largest = *std::ranges::max_element(mask.pixels);
    float levels = read_image_size(path).eight_bit ? kEight : kSixteen;
    const float white = std::round(largest * levels);
    if (white < 1) return;
    const float scale = white == 1 ? levels : white >= kFewest && white <= kEight ? levels / kEight : 1;
    for (float& value : mask.pixels) value *= scale;
    levels /= scale;
    if (white >= levels) return;
    const auto seen = std::ranges::count_if(mask.pixels, [](float value) { return value > 0; });
    const bool large = double(seen) > kObject * double(mask.pixels.size());
    const std::string largest_value =
        core::one_line(path.string()) + ": the mask's largest value is " + std::to_string(int(white));
    if (large && white < kFewest)
        throw InputError(largest_value + ", which is almost black; a mask is white where its image counts");
    if (numbers_objects(mask, levels, white, large))
        throw InputError(largest_value +
                         ", and its values seem to number objects; a mask is white (255) where "
                         "its image counts, and --masks none uses none");
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

int mask_turn(const std::filesystem::path& path, const ImageSize& mask, const ImageSize& image) {
    if (same_aspect(image.width, image.height, mask.width, mask.height)) return 1;
    constexpr int kTransposed = 5, kRight = 6, kLeft = 8;
    if (image.orientation >= kTransposed && same_aspect(image.width, image.height, mask.height, mask.width))
        return image.orientation == kRight ? kLeft : image.orientation == kLeft ? kRight : image.orientation;
    const auto size = [](const ImageSize& of) {
        return std::to_string(of.width) + " x " + std::to_string(of.height);
    };
    throw InputError(core::one_line(path.string()) + ": the mask is " + size(mask) + " pixels, its image " +
                     size(image));
}

Image load_mask(const std::filesystem::path& path, const ImageSize& image) {
    Image mask = load_mask(path);
    return oriented(mask, mask_turn(path, {mask.width, mask.height}, image));
}

}  // namespace ewa::scene
