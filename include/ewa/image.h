// SPDX-License-Identifier: Apache-2.0
// Pictures in memory, on disk, and their distance from each other. Every format but PNG and JPEG needs the
// module with OpenImageIO (libewa_openimageio.so). Where that is missing or does not fit, reading or writing
// such a file throws RunError.
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <vector>

namespace ewa {

/// Row-major, interleaved, first row at the top. 8-bit sRGB files become value / 255 with no linearisation;
/// that is the space splats are trained and blended in.
struct Image {
    int width = 0, height = 0, channels = 0;
    std::vector<float> pixels;  // width * height * channels

    Image() = default;
    Image(int width_, int height_, int channels_)
        : width(width_), height(height_), channels(channels_), pixels(size_t(width_) * height_ * channels_) {}
    float* at(int x, int y) { return &pixels[(size_t(y) * width + x) * channels]; }
    const float* at(int x, int y) const { return &pixels[(size_t(y) * width + x) * channels]; }
};

/// What the file's header says. The pixels are not decoded, so damage to them may pass. Throws InputError.
struct ImageSize {
    int width = 0, height = 0;  // as the pixels are stored
    int orientation = 1;        // EXIF's: how to turn them upright, see oriented
    bool eight_bit = true;      // no more than 256 levels
};
ImageSize read_image_size(const std::filesystem::path& path);

/// The picture turned as EXIF's orientation (1..8) says; 5 to 8 exchange width and height.
Image oriented(const Image& image, int orientation);

/// PNG, JPEG, TIFF, EXR, WebP, BMP, binary PPM and PGM, and Radiance HDR, known by their first bytes, as 3
/// (RGB) or 4 (RGBA, colour not multiplied by alpha) channels; grey becomes RGB. 16-bit integers become value
/// / 65535, floating-point files stay as they are. CMYK becomes RGB: each colour times K. EXIF's orientation is
/// left alone: the pixels come as they are stored. At most 200 million pixels, 65,535 in a direction. Throws
/// InputError, also for a truncated file.
Image load_image(const std::filesystem::path& path);

/// .png: 8 bit, rounded, clamped to [0, 1], NaN as 0. .exr: float32, not clamped. Colour is not multiplied by
/// alpha. Written beside and renamed. Throws RunError (disk), InputError (extension, no pixels).
void save_image(const std::filesystem::path& path, const Image& image);

/// The size divided by factor, rounded down, at least 1; each new pixel is the mean over the area it covers:
/// factor x factor blocks where the size is a multiple, else blocks of the exact size ratio, borders
/// weighted. factor >= 1.
Image downscale(const Image& image, int factor);

/// RGB of a picture, where it is transparent over a background. RGB pictures come back as they are.
Image over_background(const Image& image, const std::array<float, 3>& background);

/// RGB and one channel of the same size as one picture of 4 channels.
Image with_alpha(const Image& color, const Image& alpha);

/// 10 log10(1 / MSE) over RGB, both pictures clamped to [0, 1]; +inf for equal pictures.
/// Throws InputError when sizes differ.
double psnr(const Image& a, const Image& b);
/// Each pixel's share is its weight (one channel of the same size; empty: equal weights). NaN where no pixel
/// counts.
double psnr(const Image& a, const Image& b, const Image& weights);

/// Mean SSIM over pixels and RGB: 11 x 11 Gaussian window, sigma 1.5, zero padded (Wang et al. 2004), both
/// pictures clamped to [0, 1], computed in float64. Throws InputError when sizes differ.
double ssim(const Image& a, const Image& b);
/// Of a pulled onto b where it weighs less (w a + (1 - w) b), each pixel's share its weight.
double ssim(const Image& a, const Image& b, const Image& weights);

/// How far apart two pictures are.
struct ImageDifference {
    double psnr = 0, ssim = 0;  // as above: RGB, clamped to [0, 1]
    // Over all values, alpha included, not clamped. Equal values, infinite or not a number too, differ by 0,
    // others of which one is not finite by +inf (rms_error: nan where one is not a number).
    double max_error = 0;
    int max_x = 0, max_y = 0, max_channel = 0;  // where it is; px from the top left corner
    double mean_error = 0;                      // of the values that are finite in both
    double rms_error = 0;
    uint64_t over = 0;  // pixels with a value further apart than the tolerance
};

/// Compares all values, and gives PSNR and SSIM. A picture without alpha is opaque beside one that has it.
/// tolerance >= 0. Throws InputError when sizes differ.
ImageDifference compare_images(const Image& a, const Image& b, double tolerance = 0);

}  // namespace ewa
