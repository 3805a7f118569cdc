// SPDX-License-Identifier: Apache-2.0
#include "bench/stability/report.h"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "bench/format_figures.h"

namespace ewa::bench {
namespace {

using Json = nlohmann::ordered_json;

/// The comparison that uses up most of its bound.
const Comparison& tightest(const StabilityResult& result) {
    return *std::max_element(result.comparisons.begin() + 1, result.comparisons.end(),
                             [](const Comparison& a, const Comparison& b) {
                                 return a.good() && (!b.good() || a.error / a.bound < b.error / b.bound);
                             });
}

}  // namespace

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
    if (r.skipped != r.skipped_by_twin) line += text_of("  SKIPPED, the twin %u", r.skipped_by_twin);
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

}  // namespace ewa::bench
