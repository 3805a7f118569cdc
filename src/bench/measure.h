// SPDX-License-Identifier: Apache-2.0
// Runs a case and writes down what it took.
#pragma once
#include <memory>

#include "bench/result.h"
#include "gpu/device.h"

namespace ewa::bench {

struct MeasureOptions {
    int runs = 0;  // 0: see repeat()
    bool check = false;
    std::vector<std::string>
        first_step_command;  // the program, and what makes it run run_first_step() for a device
};

CaseResult measure(const std::shared_ptr<gpu::Device>& device, const Case& one, const MeasureOptions& options,
                   const Bandwidth& copies);

/// Opens a device, uploads a scene, trains one step and prints the steady clock's nanoseconds at its end.
int run_first_step(const std::string& device);

/// Starts that command in a new process with an empty shader cache, and again with the cache it left.
CaseResult measure_first_step(const Case& one, const MeasureOptions& options);

}  // namespace ewa::bench
