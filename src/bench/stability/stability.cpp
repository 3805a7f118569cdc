// SPDX-License-Identifier: Apache-2.0
#include "bench/stability/stability.h"

#include <algorithm>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "bench/cases.h"
#include "bench/stability/case_errors.h"
#include "bench/stability/cases.h"
#include "bench/stability/report.h"
#include "core/atomic_file.h"
#include "ewa/error.h"

namespace ewa::bench {
namespace {

void print(const std::string& text) {
    std::fputs(text.c_str(), stdout);
    std::fflush(stdout);
}

std::vector<StabilityCase> chosen_cases(const StabilityOptions& options) {
    if (!options.file.empty()) {
        if (!options.read)
            throw InputError(options.file.string() +
                             ": this program reads no splat files; ewa bench --stability does");
        const Gaussians gaussians = options.read(options.file);
        if (gaussians.size() == 0) throw InputError(options.file.string() + ": has no splats");
        return {stability_case_of(options.file.filename().string(), gaussians)};
    }
    std::vector<StabilityCase> chosen;
    for (StabilityCase& one : stability_cases())
        if (options.cases.empty() || name_matches(one.name, options.cases)) chosen.push_back(std::move(one));
    if (chosen.empty()) throw InputError("no stability case matches '" + options.cases + "'");
    return chosen;
}

}  // namespace

int run_stability(const StabilityOptions& options) {
    const std::vector<StabilityCase> cases = chosen_cases(options);
    const auto device = open_device({.selector = options.device});
    print("device: " + device_info(*device).name + "\n" + stability_header());
    std::vector<StabilityResult> results;
    std::vector<StabilityTraining> trainings;
    for (const StabilityCase& one : cases) {
        results.push_back(compare_with_twin(device, one));
        print(stability_line(results.back()));
    }
    if (options.training_steps > 0) print(stability_training_header());
    for (const StabilityCase& one : cases) {
        if (options.training_steps == 0) break;
        trainings.push_back(train_from(device, one, options.training_steps));
        print(stability_training_line(trainings.back()));
    }
    if (!options.json.empty())
        core::write_text_file(options.json, stability_json(results, trainings).dump(2) + "\n");
    const bool good = std::all_of(results.begin(), results.end(), [](const auto& r) { return r.good(); }) &&
                      std::all_of(trainings.begin(), trainings.end(), [](const auto& t) { return t.good(); });
    return good ? 0 : 1;
}

}  // namespace ewa::bench
