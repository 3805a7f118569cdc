// SPDX-License-Identifier: Apache-2.0
// Runs a case and measures it.
#pragma once
#include <memory>

#include "bench/result.h"
#include "gpu/device.h"

namespace ewa::bench {

struct MeasureOptions {
    int runs = 0;  // 0: see repeat()
    bool check = false;
    std::vector<std::string> first_step_command;  // the command that calls run_first_step() for a device
};

CaseResult measure(const std::shared_ptr<gpu::Device>& device, const Case& one, const MeasureOptions& options,
                   const Bandwidth& copies);

/// Opens a device, uploads a scene, trains one step and prints the time of its end (steady clock, ns).
int run_first_step(const std::string& device);

/// Runs the command in a new process, first with an empty shader cache, then with the cache of that run.
CaseResult measure_first_step(const Case& one, const MeasureOptions& options);

}  // namespace ewa::bench
