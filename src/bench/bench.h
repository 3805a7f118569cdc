// SPDX-License-Identifier: Apache-2.0
// The benchmark: speed per pass against what the host's cores can do, and error against the float64 twin.
// Both `ewa bench` and the stand-alone ewa-bench are this and nothing more.
#pragma once
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "ewa/gaussians.h"

namespace CLI {
class App;
}

namespace ewa::bench {

struct Options {
    std::string cases;   // patterns, see select_cases
    std::string device;  // as in DeviceOptions
    int runs = 0;
    bool list = false, check = false, large = false, first_step = false;
    std::filesystem::path json;
    std::filesystem::path compare;  // results to compare with
    std::filesystem::path results;  // taken in place of measuring
    bool stability = false;         // the stability suite in place of timings
    std::filesystem::path scene;    // of that: a splat file in place of the built-in cases
    int training_steps = 500;       // of that
    /// Reads a splat file, where the program can.
    std::function<Gaussians(const std::filesystem::path&)> read_splats;
};

void add_options(CLI::App& app, Options& options);

/// program: how this program is started again to run the benchmark, its path and what stands before the
/// options. Returns the exit status: 1 where a check is not within its bound. Throws InputError and RunError.
int run(const Options& options, const std::vector<std::string>& program);

}  // namespace ewa::bench
