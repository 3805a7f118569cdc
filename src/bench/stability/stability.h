// SPDX-License-Identifier: Apache-2.0
// The stability suite as a command: compares each case with the CPU reference, then trains from it.
#pragma once
#include <filesystem>
#include <functional>
#include <memory>
#include <string>

#include "ewa/device.h"
#include "ewa/gaussians.h"

namespace ewa::bench {

struct StabilityOptions {
    std::string cases;           // names or patterns as --cases takes them; empty: all
    int training_steps = 500;    // 0: none
    std::string device;          // as in DeviceOptions
    std::filesystem::path json;  // empty: none
    std::filesystem::path file;  // a user's scene instead of the built-in cases
    std::function<Gaussians(const std::filesystem::path&)> read;  // reads that file
};

/// Prints the table. Returns 1 if a bound is exceeded or a value is not finite. Throws InputError, RunError.
int run_stability(const StabilityOptions& options);

}  // namespace ewa::bench
