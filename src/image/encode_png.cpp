#include "image/encode_png.h"

#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>

#include <algorithm>
#include <cmath>

#include "ewa/error.h"

namespace ewa::image {

std::vector<unsigned char> encode_png(const Image& image) {
    std::vector<unsigned char> values(image.pixels.size());
    std::transform(image.pixels.begin(), image.pixels.end(), values.begin(), [](float v) {
        // min and max in this order turn NaN into 0.
        return static_cast<unsigned char>(std::lround(std::min(std::max(0.0f, v), 1.0f) * 255.0f));
    });

    std::vector<unsigned char> bytes;
    OIIO::Filesystem::IOVecOutput memory(bytes);
    const OIIO::ImageSpec spec(image.width, image.height, image.channels, OIIO::TypeDesc::UINT8);
    const auto output = OIIO::ImageOutput::create("png", &memory);
    if (!output) throw RunError("cannot encode a PNG: " + OIIO::geterror());
    if (!output->open("memory.png", spec) || !output->write_image(OIIO::TypeDesc::UINT8, values.data()) ||
        !output->close())
        throw RunError("cannot encode a PNG: " + output->geterror());
    return bytes;
}

}  // namespace ewa::image
