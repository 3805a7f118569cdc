// SPDX-License-Identifier: Apache-2.0
#include "bench/report.h"

#include <nlohmann/json.hpp>

namespace ewa::bench {
namespace {

Json to_json(const Spread& spread) {
    return {{"median", spread.median}, {"mad", spread.mad},     {"low", spread.low},
            {"high", spread.high},     {"least", spread.least}, {"samples", spread.samples}};
}

void add_times(Json& json, const char* prefix, const Timed& timed) {
    if (timed.wall.samples > 0) json[std::string(prefix) + "milliseconds"] = to_json(timed.wall);
    if (timed.cpu.samples > 0) json[std::string(prefix) + "cpu_milliseconds"] = to_json(timed.cpu);
}

Json to_json(const CaseResult& result, const PassResult& pass) {
    Json json{{"name", pass.name}};
    add_times(json, "", pass.time);
    add_times(json, "ceiling_", pass.ceiling);
    const double seconds = pass.time.wall.median * 1e-3;
    const auto add = [&](const char* name, double value, double by) {
        if (value > 0 && by > 0) json[name] = value / by;
    };
    add("bytes", pass.bytes, 1);
    add("gigabytes_per_second", pass.bytes * 1e-9, seconds);
    add("ceiling_share", pass.ceiling.wall.median, pass.time.wall.median);
    add("ceiling_share_cpu", pass.ceiling.cpu.median, pass.time.cpu.median);
    if (pass.name.starts_with("blend")) {
        add("pairs_evaluated_per_second", double(result.pairs_evaluated), seconds);
        add("pairs_blended_per_second", double(result.pairs_blended), seconds);
    }
    return json;
}

Json to_json(const Check& check) {
    // JSON has no number for what is not finite: such an error is null, and "good" says what to make of it.
    return {{"what", check.what}, {"error", check.error}, {"bound", check.bound}, {"good", check.good()}};
}

Json to_json(const CaseResult& result) {
    const char* kinds[] = {"forward", "train", "sort", "update", "first_step"};
    const Case& one = result.one;
    Json json{{"name", one.name},
              {"kind", kinds[int(one.kind)]},
              {"splats", one.splats},
              {"width", one.width},
              {"height", one.height},
              {"sh_degree", one.sh_degree},
              {"instances", result.instances},
              {"pairs_evaluated", result.pairs_evaluated},
              {"pairs_blended", result.pairs_blended},
              {"device_bytes", result.device_bytes},
              {"device_milliseconds", to_json(result.device)},
              {"passes", Json::array()}};
    add_times(json, "", result.total);
    add_times(json, "ceiling_blend_", result.ceiling_blend);
    for (const PassResult& pass : result.passes) json["passes"].push_back(to_json(result, pass));
    if (!result.checks.empty()) json["checks"] = Json::array();
    for (const Check& check : result.checks) json["checks"].push_back(to_json(check));
    if (!result.note.empty()) json["note"] = result.note;
    return json;
}

}  // namespace

Json to_json(const Result& result) {
    const DeviceInfo& device = result.device;
    Json json{{"schema", "ewa-bench-1"},
              {"version", result.version},
              {"device",
               {{"name", device.name},
                {"type", device.type},
                {"driver", device.driver},
                {"api_version", device.api_version},
                {"subgroup_size", device.subgroup_size},
                {"memory_bytes", device.memory_bytes}}},
              {"host",
               {{"cpu", result.host.cpu},
                {"threads", result.host.threads},
                {"vectors", result.host.vectors},
                {"load", result.host.load},
                {"copy_gigabytes_per_second", result.host.copies.wall},
                {"copy_gigabytes_per_second_cpu", result.host.copies.cpu}}},
              {"cases", Json::array()},
              {"scaling", Json::array()}};
    for (const CaseResult& one : result.cases) json["cases"].push_back(to_json(one));
    for (const Scaling& scaling : result.scaling)
        json["scaling"].push_back({{"of", scaling.of},
                                   {"against", scaling.against},
                                   {"exponent", scaling.exponent},
                                   {"residual", scaling.residual},
                                   {"points", scaling.points}});
    return json;
}

}  // namespace ewa::bench
