// SPDX-License-Identifier: Apache-2.0
#include "viewer/photo_loader.h"

#include <algorithm>
#include <utility>

namespace ewa::viewer {

PhotoLoader::PhotoLoader(std::function<void()> on_news)
    : on_news_(std::move(on_news)), thread_([this] { work(); }) {}

PhotoLoader::~PhotoLoader() {
    {
        const std::lock_guard lock(mutex_);
        stop_ = true;
    }
    wake_.notify_one();
    thread_.join();
}

void PhotoLoader::ask(int index, const Frame& frame, Size size, const std::array<float, 3>& background) {
    const std::lock_guard lock(mutex_);
    waiting_ = Request{index, frame, size, background};
    wake_.notify_one();
}

std::shared_ptr<const Photo> PhotoLoader::photo() const {
    const std::lock_guard lock(mutex_);
    return photo_;
}

void PhotoLoader::work() {
    for (;;) {
        Request request;
        {
            std::unique_lock lock(mutex_);
            wake_.wait(lock, [this] { return stop_ || waiting_; });
            if (stop_) return;
            request = *std::exchange(waiting_, std::nullopt);
        }
        auto photo = std::make_shared<Photo>();
        photo->frame = request.index;
        photo->size = {request.frame.camera.width, request.frame.camera.height};
        try {
            const Image image = load_frame_image(request.frame);
            const int factor = std::max(1, std::min(image.width / std::max(1, 2 * request.size.width),
                                                    image.height / std::max(1, 2 * request.size.height)));
            photo->picture = picture_of(factor > 1 ? downscale(image, factor) : image, request.background);
        } catch (const std::exception& error) {
            photo->failure = error.what();
        }
        {
            const std::lock_guard lock(mutex_);
            photo_ = photo;
        }
        on_news_();
    }
}

}  // namespace ewa::viewer
