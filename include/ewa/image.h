// SPDX-License-Identifier: Apache-2.0
// Images in memory and on disk, and their differences. Every format but PNG and JPEG needs the module with
// OpenImageIO (libewa_openimageio.so). If that is missing or has another version, reading or writing such a
// file throws RunError.
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <vector>

namespace ewa {

/// Row-major, interleaved, first row at the top. 8-bit sRGB files become value / 255, without linearisation.
/// Splats are trained and blended in that space.
struct Image {
    int width = 0, height = 0, channels = 0;
    std::vector<float> pixels;  // width * height * channels

    Image() = default;
    Image(int width_, int height_, int channels_)
        : width(width_), height(height_), channels(channels_), pixels(size_t(width_) * height_ * channels_) {}
    float* at(int x, int y) { return &pixels[(size_t(y) * width + x) * channels]; }
    const float* at(int x, int y) const { return &pixels[(size_t(y) * width + x) * channels]; }
};

/// Throws InputError unless there are as many pixels as the sizes say. Functions that take an Image call this check.
void check(const Image& image);

/// The contents of an image file's header. Damage to the pixels may go unnoticed: they are not decoded.
struct ImageSize {
    int width = 0, height = 0;  // as the pixels are stored
    int orientation = 1;        // EXIF's, see oriented
    bool eight_bit = true;      // no more than 256 levels
};
/// Reads an image file's header. Throws InputError for formats that load_image does not read, and for a damaged header.
ImageSize read_image_size(const std::filesystem::path& path);

/// The image turned by EXIF's orientation (1..8). 5 to 8 exchange width and height. Throws InputError for another one.
Image oriented(const Image& image, int orientation);

/// Reads PNG, JPEG, TIFF, EXR, WebP, BMP, binary PPM and PGM, and Radiance HDR, recognised by their first
/// bytes. The result has 3 channels (RGB), or 4 (RGBA, colour not multiplied by alpha). Grey becomes RGB.
/// 16-bit integers become value / 65535, and floating-point values stay. Pixels are as stored: EXIF's
/// orientation is not applied. CMYK becomes RGB: each colour times K. The limits are 200 million pixels and
/// 65,535 px per side. Throws InputError, also for a truncated file.
Image load_image(const std::filesystem::path& path);

/// Writes .png (8 bit), .jpg or .jpeg (8 bit, RGB or grey, quality 95) or .exr (float32, not clamped). Values of 8 bits are rounded
/// and clamped to [0, 1], with NaN as 0. Colour is not multiplied by alpha. A temporary file is written and renamed.
/// Throws RunError (disk, more channels than a PNG or JPEG can have), InputError (extension, no pixels).
void save_image(const std::filesystem::path& path, const Image& image);

/// Writes an equirectangular image of all directions as save_image does, and throws as it does. A PNG or JPEG gets the XMP schema
/// GPano ("Photo Sphere XMP Metadata"), by which viewers of panoramas recognise it.
void save_panorama(const std::filesystem::path& path, const Image& image);

/// Divides the size by factor >= 1, rounded down, to at least 1 px. Each new pixel is the mean over the area
/// that it covers. These areas have the exact ratio of sizes; pixels on their borders are weighted by their
/// share. Throws InputError for a factor below 1 and for an image without pixels.
Image downscale(const Image& image, int factor);

/// The image with a smaller size, as downscale makes it. width, height: 1 to those of the image. Throws InputError for others.
Image reduced(const Image& image, int width, int height);

/// The RGB of an image composited over a background. RGB images stay as they are. Throws InputError for other images than RGB
/// and RGBA.
Image over_background(const Image& image, const std::array<float, 3>& background);

/// An RGBA image from an RGB image and a one-channel image of the same size. Throws InputError for others.
Image with_alpha(const Image& color, const Image& alpha);

/// 10 log10(1 / MSE) over RGB, with both images clamped to [0, 1]. +inf for equal images. weights: of each
/// pixel, one channel of the same size; an empty image means equal weights. NaN if all weights are zero.
/// Throws InputError if the sizes differ.
double psnr(const Image& a, const Image& b, const Image& weights = {});

/// Mean SSIM over pixels and RGB (Wang et al. 2004), with an 11 x 11 Gaussian window, sigma 1.5 and zero padding. Both images are
/// clamped to [0, 1]. Computed in float64. weights: as for psnr; with weights w, the SSIM of w a + (1 - w) b and b, with each pixel
/// weighted by w. Throws InputError if the sizes differ.
double ssim(const Image& a, const Image& b, const Image& weights = {});

/// The difference of two images.
struct ImageDifference {
    double psnr = 0, ssim = 0;  // as psnr and ssim: RGB, clamped to [0, 1]
    // Over all values including alpha, not clamped. Equal values differ by 0, also if infinite or NaN. Other
    // pairs with a value that is not finite differ by +inf (rms_error: NaN if one is NaN).
    double max_error = 0;
    int max_x = 0, max_y = 0, max_channel = 0;  // position of max_error; px from the top left corner
    double mean_error = 0;                      // over the values that are finite in both
    double rms_error = 0;
    uint64_t over = 0;  // pixels with a difference above the tolerance
};

/// Compares all values, and gives PSNR and SSIM. If only one image has alpha, the other counts as opaque.
/// tolerance >= 0. Throws InputError if the sizes differ.
ImageDifference compare_images(const Image& a, const Image& b, double tolerance = 0);

}  // namespace ewa
