// SPDX-License-Identifier: Apache-2.0
// The benchmark: time per pass against the same work on the host's cores, and error against the CPU
// reference. `ewa bench` and ewa-bench are two programs around it.
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
    std::string cases;    // patterns, see select_cases
    std::string device;   // as in DeviceOptions
    std::string kernels;  // choices, see config_with
    int runs = 0;
    bool list = false, check = false, large = false, first_step = false;
    std::filesystem::path json;
    std::filesystem::path compare;  // results to compare with
    std::filesystem::path results;  // read these instead of measuring
    bool stability = false;         // run the stability suite instead of timings
    std::filesystem::path scene;    // with stability: a splat file instead of the built-in cases
    int training_steps = 500;       // with stability
    /// Reads a splat file; empty: the program cannot.
    std::function<Gaussians(const std::filesystem::path&)> read_splats;
};

void add_options(CLI::App& app, Options& options);

/// program: the command that starts this benchmark again: its path, and the words before the options. Returns
/// the exit status: 1 if a check exceeds its bound. Throws InputError, RunError.
int run(const Options& options, const std::vector<std::string>& program);

}  // namespace ewa::bench
