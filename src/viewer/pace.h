// SPDX-License-Identifier: Apache-2.0
// The resolution of a moving camera, and the frame times that the viewer reports.
#pragma once
#include <chrono>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>

namespace ewa::viewer {

struct RenderedFrame;

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

/// Seconds after the start of the program.
struct StartTimes {
    std::chrono::steady_clock::time_point started = std::chrono::steady_clock::now();
    double scene_read = 0, device_open = 0, window_open = 0;
    double now() const {
        return std::chrono::duration<double>(std::chrono::steady_clock::now() - started).count();
    }
};

/// The times of a session, for the panel and for --verbose.
class SessionTimes {
  public:
    explicit SessionTimes(const StartTimes& start) : start_(start) {}

    /// The frame is on the screen now. Counts each frame once.
    void count(const std::shared_ptr<const RenderedFrame>& frame);
    void window_is_open() { start_.window_open = start_.now(); }
    std::optional<double> first_frame() const { return first_frame_; }
    double rate() const { return fluency_.rate(start_.now()); }
    void print(const RenderedFrame* last) const;  // on standard error

  private:
    StartTimes start_;
    Fluency fluency_;
    std::optional<double> first_frame_;
    std::shared_ptr<const RenderedFrame> counted_;
};

}  // namespace ewa::viewer
