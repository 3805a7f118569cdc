// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <string>

#include "core/text.h"
#include "ewa/error.h"
#include "ewa/image.h"
#include "ewa/sky_map.h"

namespace ewa {

namespace {

/// The old pixels under one new pixel along an axis: the first one, and the covered share of each.
struct Cover {
    int first = 0;
    std::vector<double> weights;
};

std::vector<Cover> covers(int old_size, int new_size) {
    std::vector<Cover> result(static_cast<size_t>(new_size));
    for (int i = 0; i < new_size; ++i) {
        // In units of 1 / new_size of an old pixel, so that the borders are exact.
        const int64_t begin = int64_t(i) * old_size, end = int64_t(i + 1) * old_size;
        Cover& cover = result[size_t(i)];
        cover.first = static_cast<int>(begin / new_size);
        for (int64_t old = cover.first; old * new_size < end; ++old) {
            const int64_t covered = std::min(end, (old + 1) * new_size) - std::max(begin, old * new_size);
            cover.weights.push_back(double(covered) / new_size);
        }
    }
    return result;
}

std::string size_text(const Image& image) {
    return std::to_string(image.width) + " x " + std::to_string(image.height) + " px and " +
           std::to_string(image.channels) + (image.channels == 1 ? " channel" : " channels");
}

}  // namespace

void check(const Image& image) {
    if (image.width < 0 || image.height < 0 || image.channels < 0)
        throw InputError("an image of " + size_text(image));
    const size_t needed = size_t(image.width) * size_t(image.height) * size_t(image.channels);
    if (image.pixels.size() != needed)
        throw core::wrong_length("pixels", image.pixels.size(), "an image of " + size_text(image) + " needs",
                                 needed);
}

void check(const SkyMap& sky) {
    if (sky.size < 1 || sky.size > kMostSkyTexels)
        throw InputError("a sky map of " + std::to_string(sky.size) + " texels a side; it can have 1 to " +
                         std::to_string(kMostSkyTexels));
    const size_t needed = size_t(3) * size_t(sky.size) * size_t(sky.size);
    if (sky.texels.size() != needed)
        throw core::wrong_length("texels", sky.texels.size(),
                                 "a sky map of " + std::to_string(sky.size) + " texels a side needs", needed);
}

Image downscale(const Image& image, int factor) {
    if (factor < 1)
        throw InputError("an image is reduced by a factor of 1 or more, not " + std::to_string(factor));
    return reduced(image, std::max(1, image.width / factor), std::max(1, image.height / factor));
}

Image reduced(const Image& image, int width, int height) {
    check(image);
    if (width < 1 || height < 1 || width > image.width || height > image.height)
        throw InputError("an image of " + size_text(image) + " cannot be reduced to " +
                         std::to_string(width) + " x " + std::to_string(height) + " px");
    if (width == image.width && height == image.height) return image;
    Image result(width, height, image.channels);
    const std::vector<Cover> columns = covers(image.width, result.width);
    const std::vector<Cover> rows = covers(image.height, result.height);
    const double area = double(image.width) / result.width * (double(image.height) / result.height);
    std::vector<double> sum(static_cast<size_t>(image.channels));
    for (int y = 0; y < result.height; ++y) {
        const Cover& row = rows[size_t(y)];
        for (int x = 0; x < result.width; ++x) {
            const Cover& column = columns[size_t(x)];
            std::fill(sum.begin(), sum.end(), 0.0);
            for (size_t j = 0; j < row.weights.size(); ++j) {
                const float* pixel = image.at(column.first, row.first + int(j));
                for (size_t i = 0; i < column.weights.size(); ++i)
                    for (size_t c = 0; c < sum.size(); ++c)
                        sum[c] += row.weights[j] * column.weights[i] * double(*pixel++);
            }
            for (size_t c = 0; c < sum.size(); ++c) result.at(x, y)[c] = static_cast<float>(sum[c] / area);
        }
    }
    return result;
}

Image over_background(const Image& image, const std::array<float, 3>& background) {
    check(image);
    if (image.channels != 3 && image.channels != 4)
        throw InputError("an image of " + size_text(image) + " is neither RGB nor RGBA");
    if (image.channels == 3) return image;
    Image result(image.width, image.height, 3);
    for (size_t i = 0; 4 * i < image.pixels.size(); ++i) {
        const float* from = &image.pixels[4 * i];
        for (size_t c = 0; c < 3; ++c)
            result.pixels[3 * i + c] = from[c] * from[3] + background[c] * (1 - from[3]);
    }
    return result;
}

Image with_alpha(const Image& color, const Image& alpha) {
    check(color);
    check(alpha);
    if (color.channels != 3 || alpha.channels != 1 || color.width != alpha.width ||
        color.height != alpha.height)
        throw InputError("an image of " + size_text(color) + " gets no alpha from one of " +
                         size_text(alpha));
    Image result(color.width, color.height, 4);
    for (size_t i = 0; i < alpha.pixels.size(); ++i) {
        std::copy_n(&color.pixels[3 * i], 3, &result.pixels[4 * i]);
        result.pixels[4 * i + 3] = alpha.pixels[i];
    }
    return result;
}

Image oriented(const Image& image, int orientation) {
    check(image);
    if (orientation < 1 || orientation > 8)
        throw InputError("EXIF has orientations 1 to 8, not " + std::to_string(orientation));
    if (orientation == 1) return image;
    // EXIF 2.32, tag 274: where the first row and column of the stored image are in the upright one.
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
