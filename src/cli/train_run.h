// SPDX-License-Identifier: Apache-2.0
// One training run: from the arguments to the files in its folder.
#pragma once
#include <filesystem>
#include <string>

#include "cli/arguments.h"
#include "ewa/trainer.h"
#include "report/summary.h"

namespace ewa::cli {

struct TrainArguments {
    std::filesystem::path dataset, output;  // output empty: out/<dataset name>
    std::filesystem::path scene;            // the glTF that the dataset was photographed from; empty: none
    int steps = TrainOptions{}.steps;
    std::string strategy = "auto";
    uint32_t max_splats = TrainOptions{}.max_splats;
    std::string init = "sfm";  // sfm, random, or a splat file
    int downscale = 1, test_every = 8;
    MaskUse masks = MaskUse::automatic;
    uint64_t seed = 0;
    uint64_t image_cache = TrainOptions{}.image_cache_bytes >> 20;  // MiB
    bool absgrad = false, revised_opacity = false, exposure = false;
    int resolution_schedule = 0;  // halvings at the start
    DrawArguments draw;
    int eval_every = 0;     // steps; 0: only at the end
    int save_every = 0;     // steps; 0: by the clock
    bool accuracy = false;  // the report gets the diagram of error against run time
    bool resume = false;
    std::string serve;  // [ADDRESS:]PORT; empty: nobody looks on
    DeviceOptions device;
    bool quiet = false, verbose = false;
    std::string command_line;
};

/// The options that decide the result, under the names of the command line: what config.json holds.
report::Json to_config(const TrainArguments& arguments);

/// Returns the exit status.
int run_train(const TrainArguments& arguments);

}  // namespace ewa::cli
