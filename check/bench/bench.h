// SPDX-License-Identifier: Apache-2.0
// The benchmark: time per pass against the same work on the host's cores, and error against the CPU reference. ewa-bench is the
// program around it, and `ewa bench` starts that.
#pragma once
#include <filesystem>

#include "core/bench_options.h"

namespace CLI {
class App;
}

namespace ewa::bench {

struct Options : core::BenchOptions {
    bool accuracy = false;  // draw the scene in every way instead of timings
    std::filesystem::path
        scene;  // with accuracy, and with stability in place of the built-in cases: a scene file
    bool first_step = false;  // see run_first_step
};

void add_options(CLI::App& app, Options& options);

/// Returns the exit status: 1 if a check exceeds its bound. Throws InputError, RunError.
int run(const Options& options);

}  // namespace ewa::bench
