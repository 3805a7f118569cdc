// SPDX-License-Identifier: Apache-2.0
// The frames that the window asks the render thread for: at reduced resolution while the view changes, then
// in full.
#pragma once
#include <chrono>

#include "viewer/pace.h"
#include "viewer/render_thread.h"

namespace ewa::viewer {

class Renders {
  public:
    /// wake: called on the render thread when take() has something new.
    Renders(OpenDevice open, std::function<void()> wake) : thread_(std::move(open), std::move(wake)) {}

    void set_scene(std::shared_ptr<const Gaussians> gaussians);
    /// Asks for the view if it changed, or in full resolution once it has rested. full: always in full
    /// resolution.
    void ask(const Camera& camera, const Look& look, bool full);
    /// Renders the view and writes it to a file. Returns the serial of the request.
    uint64_t write(const Camera& camera, const Look& look, const std::filesystem::path& file);
    /// Asks for the point under a pixel; News::point has the answer.
    void ask_point(const Camera& camera, const glm::dvec2& pixel);

    struct News {
        bool frame = false;          // shown() is another one
        std::exception_ptr failure;  // why the last request failed, if it did
        std::optional<std::string> device;
        bool point_answered = false;
        std::optional<glm::dvec3> point;  // world; empty where no splat is at least half opaque
        std::vector<std::filesystem::path> written;
    };
    News take();

    /// The last frame, or null.
    const std::shared_ptr<const RenderedFrame>& shown() const { return shown_; }
    /// Whether the last frame is the requested one in full resolution, and no point is asked for.
    bool settled() const;
    /// Whether the requested frame has a reduced resolution, so that a better one follows.
    bool reduced() const { return asked_.divisor > 1; }

  private:
    using Clock = std::chrono::steady_clock;
    void send(const RenderRequest& request);

    uint64_t scene_ = 0, asked_scene_ = 0;
    RenderRequest asked_;
    Clock::time_point changed_;  // last change of the requested view
    std::shared_ptr<const RenderedFrame> shown_;
    uint64_t points_ = 0, points_asked_ = 0;  // answered and requested points
    Pace pace_;
    RenderThread thread_;
};

/// Whether both cameras have the same position and direction.
bool same_pose(const Camera& a, const Camera& b);

}  // namespace ewa::viewer
