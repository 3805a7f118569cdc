// SPDX-License-Identifier: Apache-2.0
// The options of ewa-bench. `ewa bench` has the same options, and passes them to ewa-bench.
#pragma once
#include <filesystem>
#include <string>

#include "core/typing.h"

namespace ewa::core {

struct BenchOptions {
    std::string cases;    // patterns with commas between them
    std::string device;   // as in DeviceOptions
    std::string kernels;  // NAME=VALUE with commas between them
    int runs = 0;         // of each case; 0: about a second
    bool list = false, check = false, large = false;
    std::filesystem::path json;
    std::filesystem::path compare;  // results to compare with
    std::filesystem::path results;  // read these instead of measuring
    bool stability = false;         // run the stability suite instead of timings
    int training_steps = 500;       // with stability
};

/// Adds the options to a parser. A template, so that this module does not need CLI11: Validator is CLI::Validator.
template <class Validator, class App>
void add_bench_options(App& app, BenchOptions& options) {
    const auto in_range = [](int low, int high) {
        return Validator([low, high](std::string& text) { return settle_number(text, low, high); }, "");
    };
    app.add_option("--json", options.json, "Write the results to this file")->type_name("FILE");
    app.add_option("--cases", options.cases,
                   "Run only the cases whose name contains, or matches if it has * or ?, one of these")
        ->type_name("PATTERN,...");
    app.add_flag("--list", options.list, "List the cases and exit");
    app.add_option("--runs", options.runs, "Runs of each case (0: as many as fit in about a second, 5 to 25)")
        ->transform(in_range(0, 1000))
        ->type_name("N");
    app.add_option("--device", options.device, "Number of the device, or part of its name (see ewa devices)")
        ->type_name("NAME|N");
    app.add_option("--kernels", options.kernels,
                   "Use other kernels than those for the device: tile=8x8, quads=N, "
                   "broadcast=shuffles|shared|uniform, sort=ranked|counted, slots=sorted|emitted, "
                   "order=splats|lists, counts=live|capacity, few=N, scan=N, elements=N, interleave=N")
        ->type_name("NAME=VALUE,...");
    app.add_flag("--check", options.check,
                 "Compare the results with the CPU reference; exit with status 1 if one exceeds its bound");
    app.add_flag("--large", options.large, "Also run the cases that take gigabytes, or minutes on a CPU");
    app.add_option("--compare", options.compare,
                   "Print new time over old time per case and pass; this file has the old ones")
        ->type_name("OLD.json");
    app.add_option("--results", options.results,
                   "With --compare: read the new results from this file instead of measuring")
        ->type_name("NEW.json");
    app.add_flag("--stability", options.stability,
                 "Compare stiff and extreme scenes with the CPU reference, and train from each; exit with "
                 "status 1 if a bound is exceeded. It takes minutes");
    app.add_option("--training-steps", options.training_steps,
                   "With --stability: training steps from each scene; 0: none")
        ->transform(in_range(0, 100000))
        ->type_name("N");
}

}  // namespace ewa::core
