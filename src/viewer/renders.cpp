// SPDX-License-Identifier: Apache-2.0
#include "viewer/renders.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <utility>

namespace ewa::viewer {
namespace {

constexpr double kGoal = 40;    // ms of a frame
constexpr double kWorth = 1.3;  // a frame this many times slower than the smallest one is fast enough
constexpr double kSlack = 1.2;  // ratio by which equal frames may differ
constexpr int kMost = 8;        // divisor

double pixels(int divisor) {
    return 1.0 / (divisor * divisor);
}

constexpr double kRestSeconds = 0.2;  // without a change, until the full resolution is requested
constexpr int kFirstDivisor = 2;      // of the first frame, which should appear soon

bool same_pose(const Camera& a, const Camera& b) {
    return a.rotation == b.rotation && a.translation == b.translation;
}

bool same_view(const RenderRequest& a, const RenderRequest& b) {
    const Camera &p = a.camera, &q = b.camera;
    return a.look == b.look && p.width == q.width && p.height == q.height && p.fx == q.fx && p.fy == q.fy &&
           p.cx == q.cx && p.cy == q.cy && same_pose(p, q);
}

}  // namespace

double Pace::share(int divisor) const {
    return fixed_ + (1 - fixed_) * pixels(divisor);
}

void Pace::drawn(int with_divisor, double milliseconds) {
    learn(with_divisor, milliseconds);
    const double full = milliseconds / share(with_divisor);
    const auto expected = [&](int divisor) { return full * share(divisor); };
    const double goal = std::max(kGoal, kWorth * expected(kMost));
    if (expected(divisor_) > kSlack * goal) {
        while (divisor_ < kMost && expected(divisor_) > goal) ++divisor_;
    } else if (divisor_ > 1 && expected(divisor_ - 1) * kSlack < goal) {
        --divisor_;
    }
}

/// Two frames of nearly the same view at different resolutions tell the fixed part.
void Pace::learn(int divisor, double milliseconds) {
    const double a = pixels(last_divisor_), b = pixels(divisor);
    if (last_ > 0 && divisor != last_divisor_) {
        const double ratio = milliseconds / last_, below = ratio * (1 - a) - (1 - b);
        const double fixed = below != 0 ? (b - ratio * a) / below : 0;
        if (std::isfinite(fixed)) fixed_ = (fixed_ + std::clamp(fixed, 0.0, 1.0)) / 2;
    }
    last_divisor_ = divisor;
    last_ = milliseconds;
}

void Fluency::shown(double time, bool moved, int divisor) {
    const double pause = time - last_;
    last_ = time;
    if (!moved || !(pause < kRest)) {
        rate_ = 0;
        return;
    }
    ++count_;
    ++by_divisor_[divisor];
    seconds_ += pause;
    // Smooth over about ten frames.
    const double rate = 1 / std::max(pause, 1e-4);
    rate_ = rate_ > 0 ? 1 / (0.9 / rate_ + 0.1 / rate) : rate;
}

void SessionTimes::count(const std::shared_ptr<const RenderedFrame>& frame) {
    if (!frame || frame == counted_) return;
    const double time = now();
    if (!first_frame_) first_frame_ = time;
    const bool moved = counted_ && !same_pose(frame->request.camera, counted_->request.camera);
    fluency_.shown(time, moved, frame->request.divisor);
    counted_ = frame;
}

void SessionTimes::print(const RenderedFrame* last) const {
    if (first_frame_)
        std::fprintf(stderr, "first picture after %.0f ms: scene read %.0f, device open %.0f, window %.0f\n",
                     1000 * *first_frame_, 1000 * scene_read, 1000 * device_open, 1000 * window_open);
    if (last)
        std::fprintf(stderr, "last picture: %d x %d px in %.1f ms\n", last->picture.width,
                     last->picture.height, last->milliseconds);
    if (fluency_.count() == 0) return;
    std::fprintf(stderr, "moving: %llu pictures in %.1f s, %.1f a second;",
                 static_cast<unsigned long long>(fluency_.count()), fluency_.seconds(),
                 double(fluency_.count()) / fluency_.seconds());
    for (const auto& [divisor, count] : fluency_.by_divisor())
        std::fprintf(stderr, " %llu at 1/%d", static_cast<unsigned long long>(count), divisor);
    std::fprintf(stderr, "\n");
}

void Renders::set_scene(std::shared_ptr<const Gaussians> gaussians, Draft draft) {
    scene_ = thread_.set_scene(std::move(gaussians));
    marked_ = false;
    set_draft(std::move(draft));
}

void Renders::set_draft(Draft draft) {
    has_draft_ = draft.splats != nullptr;
    thread_.set_draft(std::move(draft));
}

void Renders::set_marks(std::shared_ptr<const std::vector<uint8_t>> marks) {
    ++marks_;
    marked_ = marks != nullptr;
    thread_.set_marks(std::move(marks));
}

void Renders::ask(const Camera& camera, const Look& look, bool full) {
    RenderRequest request{camera, look, 1, false, asked_.serial + 1};
    const auto now = Clock::now();
    const bool first = asked_.serial == 0;
    if (first || asked_scene_ != scene_ || asked_marks_ != marks_ || !same_view(request, asked_)) {
        changed_ = now;
        request.divisor = full ? 1 : first ? kFirstDivisor : pace_.divisor();
        request.coarse = has_draft_ && !full;
    } else if (!reduced() || now - changed_ < std::chrono::duration<double>(kRestSeconds)) {
        // A full frame takes long: a moving camera should not wait for it, and a resting one needs it once.
        return;
    }
    asked_ = request;
    asked_scene_ = scene_;
    asked_marks_ = marks_;
    thread_.ask(asked_);
}

void Renders::ask_point(const Camera& camera, const glm::dvec2& pixel, PointUse use) {
    points_asked_ = thread_.ask_point(camera, pixel, use);
}

void Renders::forget_points() {
    thread_.forget_points();
    points_forgotten_ = points_asked_;
}

RenderThread::News Renders::take() {
    RenderThread::News news = thread_.take_news();
    if (!news.points.empty()) points_ = news.points.back().number;
    std::erase_if(news.points, [&](const SurfacePoint& point) { return point.number <= points_forgotten_; });
    if (news.picture != shown_) {
        shown_ = news.picture;
        // The frames of a resting view have other splats than those that set the pace.
        if (shown_->request.coarse == has_draft_) pace_.drawn(shown_->request.divisor, shown_->milliseconds);
    }
    return news;
}

bool Renders::settled() const {
    return shown_ && shown_->request.serial == asked_.serial && shown_->request.divisor == 1 &&
           !shown_->request.coarse && shown_->scene == scene_ && asked_marks_ == marks_ &&
           std::max(points_, points_forgotten_) == points_asked_;
}

}  // namespace ewa::viewer
