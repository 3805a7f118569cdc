// SPDX-License-Identifier: Apache-2.0
#include "bench/bench.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <fstream>
#include <functional>
#include <nlohmann/json.hpp>

#include "bench/accuracy.h"
#include "bench/ceiling/ceiling.h"
#include "bench/kernel_choices.h"
#include "bench/result.h"
#include "bench/stability/stability.h"
#include "core/json.h"
#include "core/outputs.h"
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

Result measure_all(const Options& options) {
    const std::vector<Case> cases = select_cases(options.cases, options.large);
    Result result;
    result.version = EWA_VERSION;
    result.host = {cpu_name(), host_threads(), vector_text(), load(), copy_bandwidth()};
    const auto device = open_device({.selector = options.device});
    result.device = device_info(*device);
    print(header_text(result));

    const MeasureOptions measuring{options.runs, options.check,
                                   config_with(options.kernels, device->limits()), result.host.copies,
                                   result.device.index};
    for (const Case& one : cases) {
        result.cases.push_back(measure(device, one, measuring));
        print(case_text(result.cases.back()));
    }
    result.scaling = fit_scaling(result.cases);
    print(scaling_text(result.scaling));
    return result;
}

}  // namespace

void add_options(CLI::App& app, Options& options) {
    core::add_bench_options<CLI::Validator>(app, options);
    app.add_flag("--accuracy", options.accuracy,
                 "Error against run time of every way to draw the scene FILE. ewa bench --accuracy makes one "
                 "of a dataset");
    app.add_option(
           "FILE", options.scene,
           "With --stability: use this scene instead of the built-in ones. ewa bench --stability makes "
           "one of a splat file")
        ->type_name("");
    app.add_flag("--first-step", options.first_step, "The new process that the case first_step starts")
        ->group("");
}

int run(const Options& options) {
    if (options.list) return list_cases(options.stability);
    core::check_outputs(
        {{"--json", options.json}},
        {{"--compare", options.compare}, {"--results", options.results}, {"FILE", options.scene}});
    if (options.accuracy) return run_accuracy(options);
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
    const Result result = measure_all(options);
    const Json json = result;
    if (!options.json.empty()) core::write_json(options.json, json);
    if (!options.compare.empty())
        print("\nagainst " + options.compare.string() + "\n" + compare_text(before, json));
    return std::all_of(result.cases.begin(), result.cases.end(), all_good) ? 0 : 1;
}

}  // namespace ewa::bench
