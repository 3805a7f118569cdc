// SPDX-License-Identifier: Apache-2.0
// How much resolution a moving camera can have, and how fluent its pictures are.
#pragma once
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <map>

namespace ewa::viewer {

class Pace {
  public:
    /// What to divide the size by while the camera moves.
    int divisor() const { return divisor_; }

    /// Told of every finished picture; aims at 15 to 50 ms for those of a moving camera.
    void drawn(int with_divisor, double milliseconds) {
        if (with_divisor == 1 && divisor_ == 1 && milliseconds > kSlow)
            divisor_ = int(std::lround(std::sqrt(milliseconds / kSlow))) + 1;
        else if (with_divisor == divisor_ && milliseconds > kSlow)
            ++divisor_;
        else if (with_divisor == divisor_ && milliseconds < kFast)
            --divisor_;
        divisor_ = std::clamp(divisor_, 1, kMost);
    }

  private:
    static constexpr double kFast = 15, kSlow = 50;  // ms
    static constexpr int kMost = 8;
    int divisor_ = 1;
};

/// Pictures of a moving camera, as they are shown.
class Fluency {
  public:
    /// A picture is shown at this time (s, of a steady clock). moved: its camera is not the last one's.
    void shown(double time, bool moved, int divisor) {
        const double pause = time - last_;
        last_ = time;
        if (!moved || !(pause < kRest)) {
            rate_ = 0;
            return;
        }
        ++count_;
        ++by_divisor_[divisor];
        seconds_ += pause;
        // Smooth over some ten pictures.
        const double rate = 1 / std::max(pause, 1e-4);
        rate_ = rate_ > 0 ? 1 / (0.9 / rate_ + 0.1 / rate) : rate;
    }
    /// Pictures a second; 0 while the camera rests.
    double rate(double time) const { return time - last_ < kRest ? rate_ : 0; }

    // Since the start.
    uint64_t count() const { return count_; }
    double seconds() const { return seconds_; }
    const std::map<int, uint64_t>& by_divisor() const { return by_divisor_; }

  private:
    static constexpr double kRest = 1;  // s; after a longer pause the camera has rested
    double last_ = -kRest, rate_ = 0, seconds_ = 0;
    uint64_t count_ = 0;
    std::map<int, uint64_t> by_divisor_;
};

}  // namespace ewa::viewer
