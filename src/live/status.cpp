// SPDX-License-Identifier: Apache-2.0
#include "live/status.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>

#include "core/json.h"
#include "core/typing.h"
#include "ewa/error.h"

namespace ewa::live {
namespace {

using report::Json;

constexpr const char* kStates[] = {"running", "paused", "done"};
constexpr size_t kLongestRun = 64;  // bytes
constexpr size_t kPaceLines = 10;   // of metrics, a tenth of a run

Json figure(double value) {
    return std::isfinite(value) ? Json(value) : Json(nullptr);
}

}  // namespace

std::string encode(const Status& status) {
    Json json;
    json["run"] = status.run;
    json["step"] = status.step;
    json["steps"] = status.steps;
    json["splats"] = status.splats;
    json["loss"] = figure(status.loss);
    json["seconds"] = figure(status.seconds);
    json["state"] = kStates[size_t(status.state)];
    json["commands"] = status.commands;
    json["metrics"] = Json::array();
    for (const report::MetricsLine& line : status.metrics) json["metrics"].push_back(report::to_json(line));
    return json.dump();
}

Status decode_status(const std::string& text) {
    const std::string name = "the trainer's status";
    const Json json = core::parse_json<Json>(text, name);
    try {
        Status status;
        status.run = json.at("run").get<std::string>();
        if (status.run.size() > kLongestRun) throw InputError("\"run\" is too long");
        status.step = int(report::whole_number(json, "step", INT32_MAX));
        status.steps = int(report::whole_number(json, "steps", INT32_MAX));
        status.splats = uint32_t(report::whole_number(json, "splats", UINT32_MAX));
        status.loss = report::number_or_nan(json, "loss");
        status.seconds = json.at("seconds").is_null() ? 0 : report::number_or_nan(json, "seconds");
        const std::string state = json.at("state").get<std::string>();
        status.state = state == "paused" ? State::paused : state == "done" ? State::done : State::running;
        status.commands = json.at("commands").get<bool>();
        const Json& lines = json.at("metrics");
        if (!lines.is_array() || lines.size() > kMostLines)
            throw InputError("\"metrics\" is not a list of at most " + std::to_string(kMostLines) + " lines");
        for (const Json& line : lines) status.metrics.push_back(report::metrics_line(line));
        return status;
    } catch (const InputError& error) {
        throw InputError(name + " cannot be read: " + error.what());
    } catch (const Json::exception& error) {
        throw InputError(name + " cannot be read: " + core::one_line(core::plain_reason(error.what())));
    }
}

double seconds_left(const Status& status) {
    const auto& lines = status.metrics;
    const double unknown = std::numeric_limits<double>::quiet_NaN();
    if (status.state != State::running || lines.size() < 2) return unknown;
    const report::MetricsLine& now = lines.back();
    const report::MetricsLine& before = lines[lines.size() - std::min(lines.size(), kPaceLines + 1)];
    const double seconds = now.wall_seconds - before.wall_seconds;
    const int steps = now.step - before.step;
    if (!(seconds > 0) || steps < 1) return unknown;
    return seconds / steps * std::max(0, status.steps - status.step);
}

}  // namespace ewa::live
