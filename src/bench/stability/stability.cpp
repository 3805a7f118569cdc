// SPDX-License-Identifier: Apache-2.0
#include "bench/stability/stability.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "bench/cases.h"
#include "bench/device_runs.h"
#include "bench/report.h"
#include "bench/stability/case_errors.h"
#include "bench/stability/cases.h"
#include "core/atomic_file.h"
#include "ewa/error.h"

namespace ewa::bench {
namespace {

/// The comparison that is closest to its bound.
const Comparison& tightest(const StabilityResult& result) {
    return *std::max_element(result.comparisons.begin() + 1, result.comparisons.end(),
                             [](const Comparison& a, const Comparison& b) {
                                 return a.good() && (!b.good() || a.error / a.bound < b.error / b.bound);
                             });
}

std::string stability_header() {
    return text_of("%-24s %6s %6s %5s | %8s %8s %9s %9s | %-14s %8s %8s %9s\n", "case", "splats", "drawn",
                   "skip", "picture", "bound", "condition", "plain det", "worst of rest", "error", "bound",
                   "condition");
}

std::string stability_line(const StabilityResult& r) {
    const Comparison &picture = r.comparisons.front(), &worst = tightest(r);
    std::string line =
        text_of("%-24s %6u %6u %5u | %8.1e %8.1e %9.1e %9.1e | %-14s %8.1e %8.1e %9.1e", r.name.c_str(),
                r.splats, r.drawn, r.skipped, picture.error, picture.bound, picture.condition,
                r.plain_determinant, worst.of.c_str(), worst.error, worst.bound, worst.condition);
    if (!r.finite) line += "  NOT FINITE";
    if (r.skipped != r.skipped_by_twin) line += text_of("  SKIPPED, the reference %u", r.skipped_by_twin);
    for (const Comparison& c : r.comparisons)
        if (!c.good()) line += "  WRONG " + c.of;
    return line + "\n";
}

std::string stability_training_header() {
    return text_of("\n%-24s %6s %10s %10s %8s %8s %8s\n", "training from", "steps", "loss", "to", "skipped",
                   "dropped", "limited");
}

std::string stability_training_line(const StabilityTraining& t) {
    return text_of("%-24s %6d %10.3g %10.3g %8u %8llu %8llu%s\n", t.name.c_str(), t.steps, t.first_loss,
                   t.last_loss, t.skipped, static_cast<unsigned long long>(t.dropped_updates),
                   static_cast<unsigned long long>(t.limited_steps), t.finite ? "" : "  NOT FINITE");
}

Json stability_json(const std::vector<StabilityResult>& results,
                    const std::vector<StabilityTraining>& trainings) {
    Json json{{"schema", "ewa-stability-1"}, {"cases", Json::array()}, {"training", Json::array()}};
    for (const StabilityResult& r : results) {
        Json one{{"name", r.name},
                 {"what", r.what},
                 {"splats", r.splats},
                 {"drawn", r.drawn},
                 {"skipped", r.skipped},
                 {"skipped_by_twin", r.skipped_by_twin},
                 {"pixels_at_threshold", r.pixels_at_threshold},
                 {"finite", r.finite},
                 {"plain_determinant_error", r.plain_determinant},
                 {"good", r.good()},
                 {"comparisons", Json::array()}};
        for (const Comparison& c : r.comparisons)
            one["comparisons"].push_back({{"of", c.of},
                                          {"error", c.error},
                                          {"bound", c.bound},
                                          {"condition", c.condition},
                                          {"good", c.good()}});
        json["cases"].push_back(std::move(one));
    }
    for (const StabilityTraining& t : trainings)
        json["training"].push_back({{"name", t.name},
                                    {"steps", t.steps},
                                    {"first_loss", t.first_loss},
                                    {"last_loss", t.last_loss},
                                    {"skipped", t.skipped},
                                    {"dropped_updates", t.dropped_updates},
                                    {"limited_steps", t.limited_steps},
                                    {"finite", t.finite}});
    return json;
}

/// The rates of 3DGS for a scene of unit extent.
pipeline::Rates rates(int step) {
    pipeline::Rates r;
    r.mean = 1.6e-4f;
    r.opacity = 0.025f;
    r.quaternion = 1e-3f;
    r.scale = 5e-3f;
    r.sh0 = 2.5e-3f;
    r.sh_rest = 1.25e-4f;
    r.step = uint32_t(step);
    return r;
}

/// Whether all values that were finite still are.
bool stayed_finite(const std::vector<float>& before, const std::vector<float>& after) {
    for (size_t i = 0; i < before.size(); ++i)
        if (std::isfinite(before[i]) && !std::isfinite(after[i])) return false;
    return before.size() == after.size();
}

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

StabilityTraining train_from(const std::shared_ptr<gpu::Device>& device, const StabilityCase& one,
                             int steps) {
    StabilityTraining result;
    result.name = one.name;
    result.steps = steps;
    // The first run changes nothing: its rates are zero.
    FrameRun run(device, {one.gaussians, one.camera, stability_photo(one.camera.width, one.camera.height)},
                 true, one.options);
    result.first_loss = pipeline::loss_of(run.counts());
    for (int step = 1; step <= steps; ++step) {
        run.set_rates(rates(step));
        run.run();
        result.last_loss = pipeline::loss_of(run.counts());
        result.finite = result.finite && std::isfinite(result.last_loss);
        result.dropped_updates += run.counts().dropped_updates;
        result.limited_steps += run.counts().limited_steps;
    }
    result.skipped = run.counts().skipped_nonfinite;
    const Gaussians end = pipeline::download_model(run.model(), run.model().params);
    const Gaussians& g = one.gaussians;
    result.finite = result.finite && stayed_finite(g.means, end.means) &&
                    stayed_finite(g.quaternions, end.quaternions) &&
                    stayed_finite(g.log_scales, end.log_scales) &&
                    stayed_finite(g.opacity_logits, end.opacity_logits) && stayed_finite(g.sh, end.sh);
    const auto planes = run.frame().planes.download<float>(run.frame().sizes.planes / 4);
    result.finite =
        result.finite && std::all_of(planes.begin(), planes.end(), [](float v) { return std::isfinite(v); });
    return result;
}

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
