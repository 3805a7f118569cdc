// SPDX-License-Identifier: Apache-2.0
// How much resolution a moving camera can have.
#pragma once
#include <algorithm>
#include <cmath>

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

}  // namespace ewa::viewer
