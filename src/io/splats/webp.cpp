// SPDX-License-Identifier: Apache-2.0
#include "io/splats/webp.h"

#include <webp/decode.h>
#include <webp/encode.h>

#include <cassert>
#include <memory>
#include <new>

#include "ewa/error.h"

namespace ewa::io {

namespace {

const uint8_t* begin_of(const std::string& bytes) {
    return reinterpret_cast<const uint8_t*>(bytes.data());
}

/// Sizes are checked, so that memory is the only reason to fail.
void require_encoded(int done) {
    if (!done) throw std::bad_alloc();
}

}  // namespace

WebpHead webp_head(const std::string& bytes, const std::string& name) {
    WebPBitstreamFeatures features;
    if (WebPGetFeatures(begin_of(bytes), bytes.size(), &features) != VP8_STATUS_OK)
        throw InputError(name + ": not a WebP image, or its header is damaged");
    if (features.has_animation) throw InputError(name + ": an animation, not an image");
    constexpr int kLossless = 2;
    return {uint64_t(features.width), uint64_t(features.height), features.format == kLossless};
}

std::vector<uint8_t> decode_webp(const std::string& bytes, const std::string& name) {
    const WebpHead head = webp_head(bytes, name);
    std::vector<uint8_t> rgba(size_t(4 * head.pixels()));
    if (!WebPDecodeRGBAInto(begin_of(bytes), bytes.size(), rgba.data(), rgba.size(), int(4 * head.width)))
        throw InputError(name + ": the image is damaged or truncated");
    return rgba;
}

std::string encode_webp(const std::vector<uint8_t>& rgba, uint64_t width, uint64_t height) {
    assert(rgba.size() == 4 * width * height);
    WebPConfig config;
    require_encoded(WebPConfigInit(&config));
    constexpr int kLevel = 6;  // of 0 to 9; above it the time doubles for less than 1 % of the size
    require_encoded(WebPConfigLosslessPreset(&config, kLevel));
    config.exact = 1;  // keeps the colours of pixels whose alpha is 0
    WebPPicture picture;
    require_encoded(WebPPictureInit(&picture));
    const std::unique_ptr<WebPPicture, void (*)(WebPPicture*)> freed(&picture, WebPPictureFree);
    picture.use_argb = 1;
    picture.width = int(width);
    picture.height = int(height);
    require_encoded(WebPPictureImportRGBA(&picture, rgba.data(), int(4 * width)));
    std::string bytes;
    picture.custom_ptr = &bytes;
    picture.writer = [](const uint8_t* data, size_t size, const WebPPicture* to) {
        static_cast<std::string*>(to->custom_ptr)->append(reinterpret_cast<const char*>(data), size);
        return 1;
    };
    require_encoded(WebPEncode(&config, &picture));
    return bytes;
}

}  // namespace ewa::io
