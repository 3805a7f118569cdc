// SPDX-License-Identifier: Apache-2.0
// How much resolution a moving camera can have, and how fluent its pictures are.
#pragma once
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <map>

namespace ewa::viewer {

/// A picture takes a time that its splats cost at any resolution, and one that its pixels cost: t(d) = full
/// (fixed + (1 - fixed) / d^2). Resolution is given up as far as that helps.
class Pace {
  public:
    /// What to divide the size by while the camera moves.
    int divisor() const { return divisor_; }

    /// Told of every finished picture.
    void drawn(int with_divisor, double milliseconds) {
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

  private:
    static constexpr double kGoal = 40;    // ms
    static constexpr double kWorth = 1.3;  // times the smallest picture's time is as good as that
    static constexpr double kSlack = 1.2;  // one picture is not as fast as the next
    static constexpr int kMost = 8;

    static double pixels(int divisor) { return 1.0 / (divisor * divisor); }
    double share(int divisor) const { return fixed_ + (1 - fixed_) * pixels(divisor); }

    /// From two pictures of nearly the same view.
    void learn(int divisor, double milliseconds) {
        const double a = pixels(last_divisor_), b = pixels(divisor);
        if (last_ > 0 && divisor != last_divisor_) {
            const double ratio = milliseconds / last_, below = ratio * (1 - a) - (1 - b);
            const double fixed = below != 0 ? (b - ratio * a) / below : 0;
            if (std::isfinite(fixed)) fixed_ = (fixed_ + std::clamp(fixed, 0.0, 1.0)) / 2;
        }
        last_divisor_ = divisor;
        last_ = milliseconds;
    }

    int divisor_ = 1, last_divisor_ = 1;
    double last_ = 0, fixed_ = 0;
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
