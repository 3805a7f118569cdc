// SPDX-License-Identifier: Apache-2.0
#include "bench/bench.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <fstream>
#include <functional>
#include <nlohmann/json.hpp>

#include "bench/ceiling/ceiling.h"
#include "bench/kernel_choices.h"
#include "bench/result.h"
#include "bench/stability/stability.h"
#include "core/json.h"
#include "core/outputs.h"
#include "core/typing.h"
#include "ewa/device.h"
#include "ewa/error.h"

namespace ewa::bench {
namespace {

std::string cpu_name() {
    std::ifstream file("/proc/cpuinfo");
    for (std::string line; std::getline(file, line);)
        if (line.starts_with("model name")) return line.substr(std::min(line.size(), line.find(':') + 2));
    return "unknown";
}

double load() {
    double value = 0;
    std::ifstream("/proc/loadavg") >> value;
    return value;
}

int list_cases(bool stability) {
    if (stability)
        for (const StabilityCase& one : stability_cases())
            std::printf("%-24s %s\n", one.name.c_str(), one.what.c_str());
    for (const Case& one : stability ? std::vector<Case>() : all_cases())
        std::printf("%s%s\n", one.name.c_str(), one.large ? "  (--large)" : "");
    return 0;
}

bool all_good(const CaseResult& result) {
    return std::all_of(result.checks.begin(), result.checks.end(), std::mem_fn(&Check::good));
}

Result measure_all(const Options& options, const std::vector<std::string>& program) {
    const std::vector<Case> cases = select_cases(options.cases, options.large);
    Result result;
    result.version = EWA_VERSION;
    result.host = {cpu_name(), host_threads(), vector_text(), load(), copy_bandwidth()};
    const auto device = open_device({.selector = options.device});
    result.device = device_info(*device);
    print(header_text(result));

    MeasureOptions measuring{options.runs, options.check, config_with(options.kernels, device->limits()),
                             result.host.copies, program};
    measuring.first_step_command.insert(measuring.first_step_command.end(),
                                        {"--first-step", "--device", std::to_string(result.device.index)});
    for (const Case& one : cases) {
        result.cases.push_back(measure(device, one, measuring));
        print(case_text(result.cases.back()));
    }
    result.scaling = fit_scaling(result.cases);
    print(scaling_text(result.scaling));
    return result;
}

CLI::Validator in_range(int low, int high) {
    return CLI::Validator([low, high](std::string& text) { return core::settle_number(text, low, high); },
                          "");
}

}  // namespace

void add_options(CLI::App& app, Options& options) {
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
    app.add_option(
           "--kernels", options.kernels,
           "Use other kernels than those for the device: tile=8x8, broadcast=shuffles|shared|uniform, "
           "sort=ranked|counted, scan=N, elements=N, interleave=N")
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
    app.add_option("FILE", options.scene,
                   "With --stability: use this splat file instead of the built-in scenes")
        ->type_name("");
    app.add_option("--training-steps", options.training_steps,
                   "With --stability: training steps from each scene; 0: none")
        ->transform(in_range(0, 100000))
        ->type_name("N");
    app.add_flag("--first-step", options.first_step, "The new process that the case first_step starts")
        ->group("");
}

int run(const Options& options, const std::vector<std::string>& program) {
    if (options.list) return list_cases(options.stability);
    core::check_outputs(
        {{"--json", options.json}},
        {{"--compare", options.compare}, {"--results", options.results}, {"FILE", options.scene}});
    if (options.stability) return run_stability(options);
    if (!options.scene.empty()) throw InputError(options.scene.string() + ": a file needs --stability");
    if (options.first_step) return run_first_step(options.device);
    if (!options.results.empty() && options.compare.empty())
        throw InputError("--results needs --compare OLD.json to compare with");
    const Json before = options.compare.empty() ? Json() : core::read_json_file<Json>(options.compare);
    if (!options.results.empty()) {
        print(compare_text(before, core::read_json_file<Json>(options.results)));
        return 0;
    }
    const Result result = measure_all(options, program);
    const Json json = result;
    if (!options.json.empty()) core::write_json(options.json, json);
    if (!options.compare.empty())
        print("\nagainst " + options.compare.string() + "\n" + compare_text(before, json));
    return std::all_of(result.cases.begin(), result.cases.end(), all_good) ? 0 : 1;
}

}  // namespace ewa::bench
