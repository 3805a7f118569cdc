// SPDX-License-Identifier: Apache-2.0
// OpenImageIO, behind a module that is loaded when the first picture needs it. Distributions build
// OpenImageIO with some two hundred libraries behind it, whose start takes longer than most commands do.
#pragma once
#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "ewa/image.h"
#include "image/format.h"

namespace ewa::image {

/// Pixels as a file has them: grey, grey and alpha, RGB, or RGBA.
struct StoredPicture {
    ImageSize size;
    int channels = 0;
    std::vector<float> values;  // of 8 bits / 255, of 16 bits / 65535
};

/// What ewa asks of OpenImageIO. Functions may be called from several threads at once. Errors are
/// std::runtime_error with OpenImageIO's reason, without the file's name, and std::bad_alloc.
class OpenImageIO {
  public:
    virtual ~OpenImageIO() = default;

    /// What larger pictures are refused by; false where OpenImageIO knows no such limits.
    virtual bool limit(uint64_t decoded_bytes, uint64_t channels) = 0;

    /// Of a file that has been looked at (format.h) and is not PNG (png_file.h). pixels: the values too.
    virtual StoredPicture read(const std::string& path, Format format, bool pixels) = 0;

    /// The bytes of a file; width * height * channels values.
    virtual std::vector<unsigned char> encode_png(int width, int height, int channels,
                                                  const uint8_t* values) = 0;
    virtual std::vector<unsigned char> encode_exr(int width, int height, int channels,
                                                  const float* values) = 0;

    /// max_error, its place, mean_error and over; a and b have one size and the same channels.
    virtual ImageDifference compare(const Image& a, const Image& b, double tolerance) = 0;

    /// Extensions without the dot, by the name of the format.
    virtual std::map<std::string, std::vector<std::string>> extensions() = 0;
};

/// What the module holds under the name kOpenImageIOEntry. A module of another version is told before
/// anything of it is called.
struct OpenImageIOModule {
    const char* version;  // EWA_VERSION
    OpenImageIO* (*instance)();
};
constexpr const char* kOpenImageIOFile = "libewa_openimageio.so";
constexpr const char* kOpenImageIOEntry = "ewa_openimageio_module";

/// Loads the module at the first call, from beside the program, or libewa, that asks; with ewa's limits
/// (limits.h). Throws RunError where there is no module, or none that fits.
OpenImageIO& openimageio();

}  // namespace ewa::image
