// SPDX-License-Identifier: Apache-2.0
// The stability suite as a command: every case against the float64 twin, then training from each.
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
    std::filesystem::path file;  // a scene of the user's in place of the built-in cases
    std::function<Gaussians(const std::filesystem::path&)> read;  // of that file
};

/// Prints the table. Returns 1 where a bound is broken or something is not finite. Throws InputError,
/// RunError.
int run_stability(const StabilityOptions& options);

}  // namespace ewa::bench
