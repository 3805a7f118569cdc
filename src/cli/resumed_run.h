// SPDX-License-Identifier: Apache-2.0
// The folder of a run as DATASET of `ewa train`, and the options that --resume takes from the run.
#pragma once
#include "ewa/run_options.h"

namespace CLI {
class App;
}

namespace ewa::cli {

/// If DATASET is the folder of a run, replaces it by the run's dataset. The output is then this folder, unless -o names
/// another one. Does nothing for another DATASET. Throws InputError, also if --resume would continue a run in another
/// folder than its own.
void settle_dataset(RunOptions& options);

/// With --resume: sets the dataset and all options that neither the command line nor --config sets, to those of the run
/// in the output folder. If this folder has no run, DATASET is required. Throws InputError.
/// keep_steps: the caller sets the number of steps, so this does not.
void take_options_of_run(CLI::App& app, RunOptions& options, bool keep_steps);

}  // namespace ewa::cli
