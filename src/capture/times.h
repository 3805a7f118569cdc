// SPDX-License-Identifier: Apache-2.0
// How long a search for cameras still takes.
#pragma once
#include <chrono>

#include "core/progress.h"
#include "ewa/capture.h"

namespace ewa::capture {

/// Estimates the time left. The pace of the current part gives the part's time. The time that COLMAP takes to search a photo gives
/// the times of later parts, by the ratios in docs/capture.md. So nothing is known before the first photo.
class Times {
  public:
    explicit Times(Matching matching) : matching_(matching) {}
    /// Sets `left` and `photo_seconds`, as far as they are known.
    void complete(CaptureProgress& now);

  private:
    using Clock = std::chrono::steady_clock;
    double rest() const;

    Matching matching_;
    std::string what_;  // empty before the first part
    CapturePhase phase_ = CapturePhase::photos;
    int first_ = 0, photos_ = 0;
    double photo_seconds_ = 0;
    Clock::time_point start_;
    core::Pace pace_;
};

}  // namespace ewa::capture
