// SPDX-License-Identifier: Apache-2.0
#include "viewer/view_quality.h"

#include <limits>

#include "ewa/image.h"

namespace ewa::viewer {

Quality quality_of(const QualityRequest& request) {
    Quality quality{request.number, std::numeric_limits<double>::quiet_NaN()};
    try {
        const auto [photo, weights] = load_training_image(request.frame, request.background);
        const Image color = with_appearance(request.rendering, request.appearance);
        if (photo.width == color.width && photo.height == color.height)
            quality.psnr = psnr(color, photo, weights);
    } catch (const std::exception&) {
        // ImageComparison says why there is no image.
    }
    return quality;
}

void ViewQuality::measure(Renders& renders, int index, const Frame& frame, const Look& look,
                          const Appearance& appearance) {
    if (index == index_ && renders.scene() == scene_ && look == look_) return;
    ++asked_;
    if (index != index_) first_ = asked_;
    index_ = index;
    scene_ = renders.scene();
    look_ = look;
    QualityRequest request{{}, frame, look.background, appearance, asked_};
    const auto take = [this, request](const Image& color) mutable {
        request.rendering = color;
        measurements_.ask(request);
    };
    renders.ask_extra({.camera = frame.camera, .look = look, .take_color = take});
}

std::optional<double> ViewQuality::psnr(int index) const {
    const auto quality = measurements_.result();
    if (index < 0 || index != index_ || !quality || quality->number < first_) return std::nullopt;
    return quality->psnr;
}

}  // namespace ewa::viewer
