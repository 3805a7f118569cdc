// SPDX-License-Identifier: Apache-2.0
// What a training run reads before it begins.
#pragma once
#include <string>
#include <vector>

#include "ewa/run.h"

namespace ewa::train {

struct RunInput {
    RunOptions options;  // with concrete strategy, SH degree and folder
    std::string name;
    Dataset dataset;
    Split split;
    Gaussians start;
    std::vector<std::string> remarks;  // for the user and the report

    /// The dataset says that SH degree 0 suffices, and the run uses that.
    bool without_view_dependence() const {
        return options.train.sh_degree == 0 && !dataset.color_depends_on_view;
    }
};

/// Loads the dataset and the first splats. Throws InputError.
RunInput load_run(const RunOptions& options);

/// `count` of the indices, evenly spread, with the first among them. All of them if there are fewer.
std::vector<int> spread_out(const std::vector<int>& indices, size_t count);

}  // namespace ewa::train
