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

/// The time left is measured for the part at hand. Parts to come are estimated from the time that COLMAP takes to search a photo;
/// docs/capture.md has the ratios.
class CaptureProgressLine {
  public:
    /// Seconds of the work after the capture, for so many photos that take so many seconds each to search.
    using After = std::function<double(int photos, double search_seconds)>;

    CaptureProgressLine(Progress& progress, Matching matching, After after)
        : progress_(progress), matching_(matching), after_(std::move(after)) {}
    void update(const CaptureProgress& now);

  private:
    double rest() const;

    Progress& progress_;
    Matching matching_;
    After after_;
    std::string what_;  // empty before the first part
    CapturePhase phase_ = CapturePhase::photos;
    int first_ = 0, done_ = 0, total_ = 0, photos_ = 0;
    double search_seconds_ = 0.5;  // of a photo; a guess before the first
};

/// The time of a training with these options.
CaptureProgressLine::After training_after(const RunOptions& options);

}  // namespace ewa::cli
