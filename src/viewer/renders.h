// SPDX-License-Identifier: Apache-2.0
// The frames that the window asks the render thread for: at reduced resolution while the view changes, then
// in full. The times of frames that the viewer reports.
#pragma once
#include <chrono>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>

#include "viewer/render_thread.h"

namespace ewa::viewer {

/// Chooses the resolution of a moving camera. A frame's time has a part that its splats cost at any
/// resolution, and a part per pixel: t(d) = full (fixed + (1 - fixed) / d^2) at divisor d. Resolution is
/// lowered only as far as that helps.
class Pace {
  public:
    /// What to divide the width and height by while the camera moves.
    int divisor() const { return divisor_; }

    /// Learns from a finished frame.
    void drawn(int with_divisor, double milliseconds);

  private:
    double share(int divisor) const;  // t(divisor) / full
    void learn(int divisor, double milliseconds);

    int divisor_ = 1, last_divisor_ = 1;
    double last_ = 0, fixed_ = 0;
};

/// The frame rate of a moving camera, counted when frames are shown.
class Fluency {
  public:
    /// A frame is shown at this time (s, of a steady clock). moved: its camera differs from that of the last
    /// frame.
    void shown(double time, bool moved, int divisor);
    /// Frames per second; 0 while the camera rests.
    double rate(double time) const { return time - last_ < kRest ? rate_ : 0; }

    // Totals since the start.
    uint64_t count() const { return count_; }
    double seconds() const { return seconds_; }
    const std::map<int, uint64_t>& by_divisor() const { return by_divisor_; }

  private:
    static constexpr double kRest = 1;  // s; after a longer pause the camera has rested
    double last_ = -kRest, rate_ = 0, seconds_ = 0;
    uint64_t count_ = 0;
    std::map<int, uint64_t> by_divisor_;
};

/// When the window has opened a file, shown its first picture and so on, in seconds after the start of the program. The panel and
/// --verbose print it.
class SessionTimes {
  public:
    double scene_read = 0, device_open = 0, window_open = 0;
    double now() const { return std::chrono::duration<double>(Clock::now() - start_).count(); }

    /// The frame is on the screen now. Counts each frame once.
    void count(const std::shared_ptr<const RenderedFrame>& frame);
    std::optional<double> first_frame() const { return first_frame_; }
    double rate() const { return fluency_.rate(now()); }
    void print(const RenderedFrame* last) const;  // on standard error

  private:
    using Clock = std::chrono::steady_clock;
    Clock::time_point start_ = Clock::now();
    Fluency fluency_;
    std::optional<double> first_frame_;
    std::shared_ptr<const RenderedFrame> counted_;
};

class Renders {
  public:
    /// wake: called on the render thread when take() has something new.
    Renders(OpenDevice open, std::function<void()> wake) : thread_(std::move(open), std::move(wake)) {}

    /// draft: as RenderThread::set_draft().
    void set_scene(std::shared_ptr<const Gaussians> gaussians, Draft draft = {});
    /// Sets the draft of the present scene, as RenderThread::set_draft().
    void set_draft(Draft draft);
    /// Sets the marks of the scene's splats, as RenderThread::set_marks().
    void set_marks(std::shared_ptr<const std::vector<uint8_t>> marks);
    bool marked() const { return marked_; }
    /// Asks for the view if it changed, or in full resolution once it has rested. full: always in full
    /// resolution.
    void ask(const Camera& camera, const Look& look, bool full);
    /// Asks for the point under a pixel, as RenderThread::ask_point(); News::points has the answer.
    void ask_point(const Camera& camera, const glm::dvec2& pixel, PointUse use);
    /// News has no answers to what was asked before.
    void forget_points();

    /// Asks for a render beside those that are shown, as RenderThread::ask_extra(); News::extras has its end.
    uint64_t ask_extra(ExtraRequest request) { return thread_.ask_extra(std::move(request)); }
    /// The number of the present scene.
    uint64_t scene() const { return scene_; }

    RenderThread::News take();

    /// The last frame, or null.
    const std::shared_ptr<const RenderedFrame>& shown() const { return shown_; }
    /// Whether the last frame is the requested one in full resolution, and no point is asked for.
    bool settled() const;
    /// Whether the requested frame has a reduced resolution or fewer splats, so that a better one follows.
    bool reduced() const { return asked_.divisor > 1 || asked_.coarse; }

  private:
    using Clock = std::chrono::steady_clock;

    uint64_t scene_ = 0, asked_scene_ = 0;
    bool has_draft_ = false, marked_ = false;
    uint64_t marks_ = 0, asked_marks_ = 0;  // numbers of set_marks()
    RenderRequest asked_;
    Clock::time_point changed_;  // last change of the requested view
    std::shared_ptr<const RenderedFrame> shown_;
    uint64_t points_ = 0, points_asked_ = 0, points_forgotten_ = 0;  // numbers of the last ones
    Pace pace_;
    RenderThread thread_;
};

}  // namespace ewa::viewer
