// SPDX-License-Identifier: Apache-2.0
#include "viewer/render_thread.h"

#include <chrono>
#include <utility>

namespace ewa::viewer {

RenderThread::RenderThread(std::shared_ptr<gpu::Device> device, const Gaussians& gaussians,
                           std::function<void()> on_news)
    : device_(std::move(device)),
      gaussians_(gaussians),
      on_news_(std::move(on_news)),
      thread_([this] { work(); }) {}

RenderThread::~RenderThread() {
    {
        const std::lock_guard lock(mutex_);
        stop_ = true;
    }
    wake_.notify_one();
    thread_.join();
}

void RenderThread::ask(const PictureRequest& request) {
    {
        const std::lock_guard lock(mutex_);
        waiting_ = request;
    }
    wake_.notify_one();
}

RenderThread::News RenderThread::news() const {
    const std::lock_guard lock(mutex_);
    return news_;
}

std::shared_ptr<const FinishedPicture> RenderThread::draw(const PictureRequest& request) {
    const auto start = std::chrono::steady_clock::now();
    // The background is added on the host: a renderer keeps its own, and a new renderer means a new upload.
    const RenderOptions options{{0, 0, 0}, request.look.kernel, request.look.sh_degree};
    if (!renderer_ || options.kernel != renderer_options_.kernel ||
        options.sh_degree != renderer_options_.sh_degree) {
        renderer_.reset();  // first, so that the scene is never on the device twice
        renderer_.emplace(device_, gaussians_, options);
        renderer_options_ = options;
    }
    const bool with_depth = request.look.mode == Mode::depth;
    const Rendering rendering = renderer_->render(downscale(request.camera, request.divisor), with_depth);

    auto finished = std::make_shared<FinishedPicture>();
    finished->request = request;
    finished->picture = picture_of(rendering, request.look.mode, request.look.background);
    finished->pass_times = renderer_->pass_times();
    finished->skipped_nonfinite = renderer_->skipped_nonfinite();
    finished->milliseconds =
        std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
    return finished;
}

void RenderThread::work() {
    for (;;) {
        PictureRequest request;
        {
            std::unique_lock lock(mutex_);
            wake_.wait(lock, [this] { return stop_ || waiting_; });
            if (stop_) return;
            request = *std::exchange(waiting_, std::nullopt);
        }
        std::shared_ptr<const FinishedPicture> finished;
        std::exception_ptr failure;
        try {
            finished = draw(request);
        } catch (...) {
            failure = std::current_exception();
        }
        {
            const std::lock_guard lock(mutex_);
            if (finished) news_.picture = finished;
            news_.failure = failure;
        }
        on_news_();
    }
}

}  // namespace ewa::viewer
