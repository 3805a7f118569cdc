// SPDX-License-Identifier: Apache-2.0
// The time of a training step by its stages, as text.
#pragma once
#include <optional>
#include <string>
#include <vector>

#include "ewa/summary.h"

namespace ewa::report {

struct NamedTime {
    std::string name;
    double milliseconds = 0;
};

/// Means, in ms a step.
struct StepTime {
    int steps = 0;                  // that the means are over
    double step = 0;                // the whole step
    double refinement = 0;          // of it: adding, moving and removing splats
    std::vector<NamedTime> passes;  // on the device
    double host = 0;                // recording and submitting the commands; 0: not measured
};

struct StageTime {
    std::string name, what;  // e.g. "blend", and what it does
    double milliseconds = 0;
};

/// The stages of a step. They add up to time.step. Passes that were measured to take longer than the step are scaled.
std::vector<StageTime> stages_of(const StepTime& time);

/// The stages as a table, with the single passes below; empty without a step. earlier: steps before the measured ones.
std::string step_time_html(const StepTime& time, int earlier = 0);

/// Data that the ranks of a run exchanged, as a table; empty without ranks.
std::string ranks_html(const std::vector<RankFigures>& ranks);

/// Data that a training in chunks copied, as a paragraph; empty without chunks.
std::string chunks_html(const std::optional<ChunkFigures>& chunks);

}  // namespace ewa::report
