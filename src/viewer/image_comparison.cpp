// SPDX-License-Identifier: Apache-2.0
#include "viewer/image_comparison.h"

#include <algorithm>

namespace ewa::viewer {

CameraImage load_camera_image(const ImageRequest& request) {
    CameraImage photo;
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

Compared compare_with_image(const ComparisonRequest& request) {
    Compared compared;
    compared.of = request;
    compared.difference = difference(request.rendering->picture, request.image->picture, request.place);
    compared.psnr = psnr_of_difference(compared.difference, request.place);
    if (request.gain > 0)
        amplify(compared.difference, request.gain);
    else
        compared.difference = {};
    return compared;
}

void ImageComparison::set_scene(uint64_t scene) {
    scene_ = scene;
    image_.reset();
    image_requested_.reset();
}

void ImageComparison::load(int index, const Frame& frame, Size place,
                           const std::array<float, 3>& background) {
    if (image_requested_ && image_requested_->index == index &&
        place.width <= 2 * image_requested_->size.width && image_requested_->background == background)
        return;
    image_requested_ = ImageRequest{scene_, index, frame, place, background};
    images_.ask(*image_requested_);
}

void ImageComparison::compare(const std::optional<ComparisonRequest>& request) {
    if (request && requested_ != request) comparisons_.ask(*request);
    requested_ = request;
}

ImageComparison::News ImageComparison::take() {
    News news = News::none;
    if (const auto compared = comparisons_.result(); compared != compared_) {
        compared_ = compared;
        news = News::comparison;
    }
    if (const auto image = images_.result(); image != image_ && image && image->scene == scene_) {
        image_ = image;
        news = News::image;
    }
    return news;
}

std::shared_ptr<const Compared> ImageComparison::compared() const {
    return compared_ && requested_ && compared_->of == *requested_ ? compared_ : nullptr;
}

}  // namespace ewa::viewer
