// SPDX-License-Identifier: Apache-2.0
// The folder of a run as DATASET of `ewa train`, and the options that --resume takes from the run.
#pragma once
#include "ewa/run_options.h"

namespace CLI {
class App;
}

namespace ewa::cli {

/// Lets DATASET, if it is the folder of a run, stand for that run: the output is its folder unless -o names another one,
/// and the dataset is the run's. Leaves other DATASETs. Throws InputError, also if --resume would continue a run in
/// another folder than its own.
void settle_dataset(RunOptions& options);

/// With --resume: gives all options that neither the command line nor --config gives the values of the run in the output
/// folder, if one is there; its dataset, too. Without a run there, DATASET is needed. Throws InputError.
/// keep_steps: the number of steps is given otherwise.
void take_options_of_run(CLI::App& app, RunOptions& options, bool keep_steps);

}  // namespace ewa::cli
