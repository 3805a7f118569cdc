// SPDX-License-Identifier: Apache-2.0
#include "viewer/comparison.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace ewa::viewer {
namespace {

/// Channel c at a position in pixels. Pixel centres are at +0.5; the border is repeated.
float bilinear(const ByteImage& picture, double x, double y, size_t c) {
    const double left = std::clamp(x - 0.5, 0.0, picture.width - 1.0);
    const double top = std::clamp(y - 0.5, 0.0, picture.height - 1.0);
    const int x0 = int(left), y0 = int(top);
    const int x1 = std::min(x0 + 1, picture.width - 1), y1 = std::min(y0 + 1, picture.height - 1);
    const float u = float(left - x0), v = float(top - y0);
    const auto at = [&](int px, int py) {
        return float(picture.rgba[4 * (size_t(py) * size_t(picture.width) + size_t(px)) + c]);
    };
    return (at(x0, y0) * (1 - u) + at(x1, y0) * u) * (1 - v) + (at(x0, y1) * (1 - u) + at(x1, y1) * u) * v;
}

}  // namespace

ByteImage difference(const ByteImage& rendering, const ByteImage& image, const Rectangle& place) {
    ByteImage result{rendering.width, rendering.height, std::vector<uint8_t>(rendering.rgba.size()), 0};
    const double scale_x = double(image.width) / std::max(1, place.width);
    const double scale_y = double(image.height) / std::max(1, place.height);
    for (int y = 0; y < result.height; ++y)
        for (int x = 0; x < result.width; ++x) {
            const size_t at = 4 * (size_t(y) * size_t(result.width) + size_t(x));
            result.rgba[at + 3] = 255;
            const int inner_x = x - place.x, inner_y = y - place.y;
            if (inner_x < 0 || inner_y < 0 || inner_x >= place.width || inner_y >= place.height) continue;
            for (size_t c = 0; c < 3; ++c) {
                const float value = bilinear(image, (inner_x + 0.5) * scale_x, (inner_y + 0.5) * scale_y, c);
                result.rgba[at + c] = uint8_t(std::abs(float(rendering.rgba[at + c]) - value) + 0.5f);
            }
        }
    return result;
}

void amplify(ByteImage& picture, float gain) {
    for (size_t i = 0; i < picture.rgba.size(); ++i)
        if (i % 4 != 3) picture.rgba[i] = uint8_t(std::min(float(picture.rgba[i]) * gain, 255.0f) + 0.5f);
}

CameraImage load_camera_image(const ImageRequest& request) {
    CameraImage loaded{.scene = request.scene, .frame = request.index, .picture = {}, .failure = {}};
    try {
        const Image image = load_frame_image(request.frame);
        const int factor = std::max(1, std::min(image.width / std::max(1, 2 * request.size.width),
                                                image.height / std::max(1, 2 * request.size.height)));
        loaded.picture = picture_of(factor > 1 ? downscale(image, factor) : image, request.background);
    } catch (const std::exception& error) {
        loaded.failure = error.what();
    }
    return loaded;
}

Compared compare_with_image(const ComparisonRequest& request) {
    Compared compared;
    compared.of = request;
    compared.difference = difference(request.rendering->picture, request.image->picture, request.place);
    amplify(compared.difference, request.gain);
    return compared;
}

void ImageComparison::forget_scene() {
    ++scene_;
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

bool ImageComparison::take() {
    compared_ = comparisons_.result();
    const auto image = images_.result();
    if (image == image_ || !image || image->scene != scene_) return false;
    image_ = image;
    return true;
}

std::shared_ptr<const Compared> ImageComparison::compared() const {
    return compared_ && requested_ && compared_->of == *requested_ ? compared_ : nullptr;
}

}  // namespace ewa::viewer
