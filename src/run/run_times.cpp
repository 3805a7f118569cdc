// SPDX-License-Identifier: Apache-2.0
#include "run/run_times.h"

#include <cmath>
#include <cstdint>
#include <nlohmann/json.hpp>

#include "core/atomic_file.h"
#include "core/json_field.h"

namespace ewa::train {
namespace {

using PlainJson = nlohmann::json;

PlainJson rows_of(const std::vector<TimesAt>& times) {
    PlainJson rows = PlainJson::array();
    for (const TimesAt& time : times) rows.push_back({time.step, time.seconds, time.wall_seconds});
    return rows;
}

/// A list of a step and two times each.
std::vector<TimesAt> times_in(const core::JsonField& all, const char* name) {
    std::vector<TimesAt> times;
    for (const core::JsonField& row : all.items(name)) {
        const std::vector<double> values = row.numbers(nullptr, 3);
        if (values[0] < 0 || values[0] > INT32_MAX || values[0] != std::floor(values[0]) || values[1] < 0 ||
            values[2] < 0)
            row.fail("is no step with two times");
        times.push_back({int(values[0]), values[1], values[2]});
    }
    return times;
}

}  // namespace

report::StepTime report_times(const StepTimes& times) {
    report::StepTime result{times.steps, times.step, times.refinement, {}, times.host};
    for (const PassTime& time : times.passes) result.passes.push_back({time.pass, time.milliseconds});
    return result;
}

void add_checkpoint(RunTimes& times, const TimesAt& checkpoint) {
    times.checkpoints.push_back(checkpoint);
    while (times.checkpoints.size() > 2) times.checkpoints.erase(times.checkpoints.begin());
}

std::vector<TimesAt> times_of(const std::vector<MetricsLine>& metrics) {
    std::vector<TimesAt> times;
    for (const MetricsLine& line : metrics) times.push_back({line.step, line.seconds, line.wall_seconds});
    return times;
}

std::vector<MetricsLine> without_times(std::vector<MetricsLine> metrics) {
    for (MetricsLine& line : metrics) line.seconds = line.wall_seconds = 0;
    return metrics;
}

void take_times(std::vector<MetricsLine>& metrics, const RunTimes& times) {
    for (size_t i = 0; i < metrics.size() && i < times.metrics.size(); ++i) {
        if (metrics[i].step != times.metrics[i].step) continue;
        metrics[i].seconds = times.metrics[i].seconds;
        metrics[i].wall_seconds = times.metrics[i].wall_seconds;
    }
}

void write_times(const std::filesystem::path& path, const RunTimes& times) {
    const PlainJson json{{"metrics", rows_of(times.metrics)}, {"checkpoints", rows_of(times.checkpoints)}};
    core::write_text_file(path, json.dump() + '\n');
}

RunTimes read_times(const std::filesystem::path& path) {
    const auto field = core::JsonField::of_file(path);
    return {times_in(field, "metrics"), times_in(field, "checkpoints")};
}

TimesAt restored_times(const std::filesystem::path& path, TimesAt own, std::vector<MetricsLine>& metrics) {
    if (own.wall_seconds == 0) try {
            const RunTimes known = read_times(path);
            for (const TimesAt& time : known.checkpoints)
                if (time.step == own.step) own = time;
            take_times(metrics, known);
        } catch (const InputError&) {
            // What was trained matters more than how long it took.
        }
    return own;
}

}  // namespace ewa::train
