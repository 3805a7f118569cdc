// SPDX-License-Identifier: Apache-2.0
// One progress line for all steps that find cameras, and for the training that follows.
#pragma once
#include <functional>
#include <string>
#include <utility>

#include "cli/output.h"
#include "ewa/capture.h"
#include "ewa/run_options.h"

namespace ewa::cli {

class CaptureProgressLine {
  public:
    /// Seconds of the work after the capture, for so many photos that take so many seconds each to search.
    using After = std::function<double(int photos, double search_seconds)>;
    /// Gives a line for the user before the search of features in so many photos.
    using Before = std::function<std::string(int photos)>;

    CaptureProgressLine(Progress& progress, After after, Before before)
        : progress_(progress), after_(std::move(after)), before_(std::move(before)) {}
    void update(const CaptureProgress& now);

  private:
    Progress& progress_;
    After after_;
    Before before_;     // until it is said
    std::string what_;  // empty before the first part
    CapturePhase phase_ = CapturePhase::photos;
    int total_ = 0, photos_ = 0;
};

/// Estimates the time of a training with these options, s.
CaptureProgressLine::After training_after(const RunOptions& options);

/// Gives a line that proposes a shorter training, if these options take long on a CPU. size: of the photos, px. training:
/// estimates the time of the training.
CaptureProgressLine::Before advice_before(const RunOptions& options, const ImageSize& size,
                                          CaptureProgressLine::After training);

}  // namespace ewa::cli
