// SPDX-License-Identifier: Apache-2.0
// One progress line for all that finds cameras, and for the training that follows.
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
    /// A line for the user before so many photos are searched.
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

/// The time of a training with these options.
CaptureProgressLine::After training_after(const RunOptions& options);

/// What proposes a shorter training, where these options take long on a CPU. size: of the photos. training: its time.
CaptureProgressLine::Before advice_before(const RunOptions& options, const ImageSize& size,
                                          CaptureProgressLine::After training);

}  // namespace ewa::cli
