// SPDX-License-Identifier: Apache-2.0
// What the module shows: one name, by which src/image finds all of it.
#include <OpenImageIO/imageio.h>

#include "openimageio/functions.h"

namespace ewa::openimageio {
namespace {

class Functions : public image::OpenImageIO {
  public:
    bool limit(uint64_t decoded_bytes, uint64_t channels) override {
        return OIIO::attribute("limits:imagesize_MB", int(decoded_bytes >> 20)) &&
               OIIO::attribute("limits:channels", int(channels));
    }
    image::StoredPicture read(const std::string& path, image::Format format, bool pixels) override {
        return openimageio::read(path, format, pixels);
    }
    std::vector<unsigned char> encode_png(int width, int height, int channels,
                                          const uint8_t* values) override {
        return openimageio::encode_png(width, height, channels, values);
    }
    std::vector<unsigned char> encode_exr(int width, int height, int channels, const float* values) override {
        return openimageio::encode_exr(width, height, channels, values);
    }
    ImageDifference compare(const Image& a, const Image& b, double tolerance) override {
        return openimageio::compare(a, b, tolerance);
    }
    std::map<std::string, std::vector<std::string>> extensions() override {
        return OIIO::get_extension_map();
    }
};

image::OpenImageIO* instance() {
    static Functions functions;
    return &functions;
}

}  // namespace
}  // namespace ewa::openimageio

extern "C" __attribute__((visibility("default"))) const ewa::image::OpenImageIOModule ewa_openimageio_module;
const ewa::image::OpenImageIOModule ewa_openimageio_module = {EWA_VERSION, ewa::openimageio::instance};
