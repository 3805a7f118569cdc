// SPDX-License-Identifier: Apache-2.0
#include "run/run_times.h"

#include <cmath>
#include <cstdint>
#include <nlohmann/json.hpp>

#include "core/atomic_file.h"
#include "core/json.h"
#include "core/text.h"
#include "ewa/error.h"

namespace ewa::train {
namespace {

using PlainJson = nlohmann::json;

PlainJson rows_of(const std::vector<TimesAt>& times) {
    PlainJson rows = PlainJson::array();
    for (const TimesAt& time : times) rows.push_back({time.step, time.seconds, time.wall_seconds});
    return rows;
}

std::vector<TimesAt> times_in(const PlainJson& all, const char* name, const std::string& file) {
    const auto wrong = [&] {
        return InputError(file + ": \"" + name + "\" is no list of a step and two times each");
    };
    const auto is_time = [](const PlainJson& value) {
        return value.is_number() && std::isfinite(value.get<double>()) && value.get<double>() >= 0;
    };
    if (!all.is_object() || !all.contains(name) || !all[name].is_array()) throw wrong();
    std::vector<TimesAt> times;
    for (const PlainJson& row : all[name]) {
        if (!row.is_array() || row.size() != 3 || !row[0].is_number_unsigned() ||
            row[0].get<uint64_t>() > INT32_MAX || !is_time(row[1]) || !is_time(row[2]))
            throw wrong();
        times.push_back({row[0].get<int>(), row[1].get<double>(), row[2].get<double>()});
    }
    return times;
}

}  // namespace

report::StepTime report_times(const StepTimes& times) {
    report::StepTime result{times.steps, times.step, times.refinement, {}};
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
    const PlainJson all = core::read_json_file<PlainJson>(path);
    const std::string file = core::one_line(path.string());
    return {times_in(all, "metrics", file), times_in(all, "checkpoints", file)};
}

}  // namespace ewa::train
