// SPDX-License-Identifier: Apache-2.0
#include "ewa/error.h"
#include "image/image_files.h"
#include "pathtracer/path_tracer.h"

namespace ewa::pathtracer {

std::vector<Image> decode_images(const scene::MeshScene& scene) {
    constexpr int kLargest = 8192;
    std::vector<Image> images;
    for (const scene::EncodedImage& encoded : scene.images)
        images.push_back(image::decode(encoded.bytes, encoded.what, kLargest));
    return images;
}

}  // namespace ewa::pathtracer
