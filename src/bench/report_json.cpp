// SPDX-License-Identifier: Apache-2.0
#include "bench/report.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "ewa/error.h"

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
    // An error that is not finite becomes null: JSON has no such number. "good" tells whether it passed.
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

constexpr double kSigmas = 3;  // standard deviations of the ratio that count as noise
// Two processes of one program differ by this much, even if the spread within each is smaller.
constexpr double kSmallest = 0.05;
constexpr double kSmallestMilliseconds = 0.1;

const Json* named(const Json& list, const std::string& name) {
    for (const Json& one : list)
        if (one.at("name") == name) return &one;
    return nullptr;
}

/// The spread under a key; without samples if it is missing.
Spread spread_at(const Json& json, const std::string& key) {
    Spread spread;
    if (!json.contains(key)) return spread;
    spread.median = json.at(key).at("median");
    spread.mad = json.at(key).at("mad");
    spread.samples = json.at(key).at("samples");
    return spread;
}

std::string ratio_text(const char* what, const Spread& before, const Spread& after) {
    if (!(before.median > 0) || !(after.median > 0)) return "";
    const double ratio = after.median / before.median;
    const double sigma = std::hypot(relative_noise(before), relative_noise(after));
    const double noise = std::max(kSigmas * sigma, kSmallest);
    const bool within = std::abs(std::log(ratio)) <= std::log1p(noise) ||
                        std::abs(after.median - before.median) < kSmallestMilliseconds;
    const char* mark = within ? "" : ratio < 1 ? "faster" : "SLOWER";
    return text_of("  %s %9.3f -> %9.3f  x %.3f +- %.3f %-6s", what, before.median, after.median, ratio,
                   ratio * noise, mark);
}

/// prefix: of the keys of wall and CPU time.
std::string ratio_line(const std::string& name, const Json& before, const Json& after,
                       const std::string& prefix) {
    const std::string wall = prefix + "milliseconds", cpu = prefix + "cpu_milliseconds";
    const std::string text = ratio_text("wall", spread_at(before, wall), spread_at(after, wall)) +
                             ratio_text("CPU", spread_at(before, cpu), spread_at(after, cpu));
    return text.empty() ? text : text_of("  %-22s%s\n", name.c_str(), text.c_str());
}

std::string compare_case(const Json& before, const Json& after) {
    std::string text = text_of("\n%s\n", after.at("name").get<std::string>().c_str());
    for (const char* count : {"instances", "pairs_evaluated", "pairs_blended", "device_bytes"})
        if (before.at(count) != after.at(count))
            text += text_of("  %-22s  %s -> %s\n", count, before.at(count).dump().c_str(),
                            after.at(count).dump().c_str());
    for (const Json& pass : after.at("passes")) {
        const std::string name = pass.at("name");
        const Json* old_pass = named(before.at("passes"), name);
        text += old_pass ? ratio_line(name, *old_pass, pass, "") : text_of("  %s: new\n", name.c_str());
    }
    for (const Json& pass : before.at("passes"))
        if (!named(after.at("passes"), pass.at("name")))
            text += text_of("  %s: gone\n", pass.at("name").get<std::string>().c_str());
    return text + ratio_line("with the host's part", before, after, "") +
           ratio_line("blend on the host", before, after, "ceiling_blend_");
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

std::string compare_text(const Json& old_results, const Json& new_results) {
    try {
        if (old_results.at("schema") != new_results.at("schema"))
            throw InputError("results of schema " + old_results.at("schema").dump() +
                             " cannot be compared with results of schema " + new_results.at("schema").dump());
        std::string text;
        const std::string before = old_results.at("device").at("name"),
                          after = new_results.at("device").at("name");
        if (before != after) text += "not the same device: " + before + " -> " + after + "\n";
        for (const Json& one : new_results.at("cases"))
            if (const Json* old_case = named(old_results.at("cases"), one.at("name")))
                text += compare_case(*old_case, one);
        return text.empty() ? "no case is in both\n" : text;
    } catch (const Json::exception& error) {
        throw InputError(std::string("not results of the benchmark: ") + error.what());
    }
}

}  // namespace ewa::bench
