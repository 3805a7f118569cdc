// SPDX-License-Identifier: Apache-2.0
#include "live/status.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>

#include "core/json_field.h"

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
    const auto field = core::JsonField::of_text(text, "the trainer's status");
    Status status;
    status.run = field.text("run");
    if (status.run.size() > kLongestRun) field.fail("\"run\" is too long");
    status.step = int(field.whole("step", INT32_MAX));
    status.steps = int(field.whole("steps", INT32_MAX));
    status.splats = uint32_t(field.whole("splats", UINT32_MAX));
    status.loss = report::number_or_nan(field, "loss");
    status.seconds = field.number("seconds", 0);
    const std::string& state = field.text("state");
    status.state = state == "paused" ? State::paused : state == "done" ? State::done : State::running;
    status.commands = field.flag("commands");
    if (field.list("metrics").size() > kMostLines)
        field.fail("\"metrics\" has more than " + std::to_string(kMostLines) + " lines");
    for (const core::JsonField& line : field.items("metrics"))
        status.metrics.push_back(report::metrics_line(line));
    return status;
}

std::string encode(const EditReply& reply) {
    return Json{{"step", reply.step},
                {"splats", reply.splats},
                {"removed", reply.counts.removed},
                {"frozen", reply.counts.frozen},
                {"unfrozen", reply.counts.unfrozen}}
        .dump();
}

EditReply decode_edit_reply(const std::string& text) {
    const auto field = core::JsonField::of_text(text, "the trainer's answer to an edit");
    const auto splats = [&](const char* key) { return uint32_t(field.whole(key, UINT32_MAX)); };
    return {int(field.whole("step", INT32_MAX)),
            splats("splats"),
            {splats("removed"), splats("frozen"), splats("unfrozen")}};
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
