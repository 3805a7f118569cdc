// SPDX-License-Identifier: Apache-2.0
#include "image/image_files.h"
#include "ewa/error.h"
#include "photograph/photographer.h"

namespace ewa::photograph {

std::vector<Image> decode_images(const mesh::Scene& scene) {
    constexpr int kLargest = 8192;
    std::vector<Image> images;
    for (const mesh::EncodedImage& encoded : scene.images)
        images.push_back(image::decode(encoded.bytes, encoded.what, kLargest));
    return images;
}

}  // namespace ewa::photograph
