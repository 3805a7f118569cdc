// SPDX-License-Identifier: Apache-2.0
#include "viewer/renders.h"

#include <utility>

namespace ewa::viewer {
namespace {

constexpr double kRestSeconds = 0.2;  // without a change, until the full resolution is requested
constexpr int kFirstDivisor = 2;      // of the first frame, which should appear soon

bool same_view(const RenderRequest& a, const RenderRequest& b) {
    const Camera &p = a.camera, &q = b.camera;
    return a.look == b.look && p.width == q.width && p.height == q.height && p.fx == q.fx && p.fy == q.fy &&
           p.cx == q.cx && p.cy == q.cy && same_pose(p, q);
}

}  // namespace

bool same_pose(const Camera& a, const Camera& b) {
    return a.rotation == b.rotation && a.translation == b.translation;
}

void Renders::set_scene(std::shared_ptr<const Gaussians> gaussians) {
    scene_ = thread_.set_scene(std::move(gaussians));
}

void Renders::send(const RenderRequest& request) {
    asked_ = request;
    asked_scene_ = scene_;
    thread_.ask(asked_);
}

void Renders::ask(const Camera& camera, const Look& look, bool full) {
    RenderRequest request{camera, look, 1, asked_.serial + 1, {}};
    const auto now = Clock::now();
    const bool first = asked_.serial == 0;
    if (first || asked_scene_ != scene_ || !same_view(request, asked_)) {
        changed_ = now;
        request.divisor = full ? 1 : first ? kFirstDivisor : pace_.divisor();
    } else if (asked_.divisor == 1 || now - changed_ < std::chrono::duration<double>(kRestSeconds)) {
        // A full frame takes long: a moving camera should not wait for it, and a resting one needs it once.
        return;
    }
    send(request);
}

uint64_t Renders::write(const Camera& camera, const Look& look, const std::filesystem::path& file) {
    send({camera, look, 1, asked_.serial + 1, file});
    return asked_.serial;
}

void Renders::ask_point(const Camera& camera, const glm::dvec2& pixel) {
    points_asked_ = thread_.ask_point(camera, pixel);
}

Renders::News Renders::take() {
    RenderThread::News news = thread_.take_news();
    News result{false,      news.failure,           std::move(news.device), news.points > points_,
                news.point, std::move(news.written)};
    points_ = news.points;
    if (news.picture != shown_) {
        shown_ = news.picture;
        pace_.drawn(shown_->request.divisor, shown_->milliseconds);
        result.frame = true;
    }
    return result;
}

bool Renders::settled() const {
    return shown_ && shown_->request.serial == asked_.serial && shown_->request.divisor == 1 &&
           shown_->scene == scene_ && points_ == points_asked_;
}

}  // namespace ewa::viewer
