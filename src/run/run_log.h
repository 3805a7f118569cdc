// SPDX-License-Identifier: Apache-2.0
// The lines of a run's metrics, and what an edit of its splats leaves in notes and in the report.
#pragma once
#include <optional>
#include <string>
#include <vector>

#include "ewa/evaluation.h"
#include "report/summary.h"
#include "report/tensorboard.h"
#include "run/run_files.h"
#include "run/run_saves.h"

namespace ewa::train {

/// Writes metrics.jsonl, and events for TensorBoard.
class RunLog {
  public:
    /// Begins the files with the lines of `progress`, which gets all later lines. It must outlive this object. Throws RunError.
    RunLog(const RunWriter& folder, bool tensorboard, RunProgress& progress);

    /// Adds a line after the last step, with the figures of an evaluation, or with the counts of an edit. Throws RunError.
    const MetricsLine& add(const std::optional<Evaluation>& evaluation,
                           const std::optional<EditCounts>& edit = {});

  private:
    RunProgress& progress_;
    report::MetricsLog lines_;
    std::optional<report::EventsLog> events_;
};

/// One line on an edit, such as "step 500: an edit removed 12 splats, froze 3 splats".
std::string edit_text(int step, const EditCounts& edit);
/// Those lines for all edits in the metrics.
std::vector<std::string> edit_texts(const std::vector<MetricsLine>& metrics);

}  // namespace ewa::train
