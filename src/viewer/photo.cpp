// SPDX-License-Identifier: Apache-2.0
#include "viewer/photo.h"

#include <algorithm>

namespace ewa::viewer {

Photo load_photo(const PhotoRequest& request) {
    Photo photo;
    photo.scene = request.scene;
    photo.frame = request.index;
    try {
        const Image image = load_frame_image(request.frame);
        const int factor = std::max(1, std::min(image.width / std::max(1, 2 * request.size.width),
                                                image.height / std::max(1, 2 * request.size.height)));
        photo.picture = picture_of(factor > 1 ? downscale(image, factor) : image, request.background);
    } catch (const std::exception& error) {
        photo.failure = error.what();
    }
    return photo;
}

Compared compare_with_photo(const ComparisonRequest& request) {
    Compared compared;
    compared.of = request;
    compared.difference = difference(request.rendering->picture, request.photo->picture, request.place);
    compared.psnr = psnr_of_difference(compared.difference, request.place);
    if (request.gain > 0)
        amplify(compared.difference, request.gain);
    else
        compared.difference = {};
    return compared;
}

}  // namespace ewa::viewer
