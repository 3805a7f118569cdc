// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <cstdarg>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "bench/result.h"
#include "core/typing.h"
#include "ewa/error.h"

namespace ewa::bench {

std::string text_of(const char* format, ...) {
    va_list arguments, again;
    va_start(arguments, format);
    va_copy(again, arguments);
    const int length = std::vsnprintf(nullptr, 0, format, arguments);
    std::string text(size_t(length > 0 ? length : 0), '\0');
    std::vsnprintf(text.data(), text.size() + 1, format, again);
    va_end(again);
    va_end(arguments);
    return text;
}

void print(const std::string& text) {
    std::fputs(text.c_str(), stdout);
    std::fflush(stdout);
}

void to_json(Json& json, const Spread& spread) {
    json = {{"median", spread.median}, {"mad", spread.mad},     {"low", spread.low},
            {"high", spread.high},     {"least", spread.least}, {"samples", spread.samples}};
}

void add_times(Json& json, const std::string& prefix, const Timed& timed) {
    if (timed.wall.samples > 0) json[prefix + "milliseconds"] = timed.wall;
    if (timed.cpu.samples > 0) json[prefix + "cpu_milliseconds"] = timed.cpu;
}

Json pass_json(const CaseResult& result, const PassResult& pass) {
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

void to_json(Json& json, const Check& check) {
    // An error that is not finite becomes null: JSON has no such number. "good" tells whether it passed.
    json = {{"what", check.what}, {"error", check.error}, {"bound", check.bound}, {"good", check.good()}};
}

void to_json(Json& json, const CaseResult& result) {
    const Case& one = result.one;
    json = {{"name", one.name},
            {"kind", name_of(one.kind)},
            {"splats", one.splats},
            {"width", one.width},
            {"height", one.height},
            {"sh_degree", one.sh_degree},
            {"instances", result.instances},
            {"pairs_evaluated", result.pairs_evaluated},
            {"pairs_blended", result.pairs_blended},
            {"device_bytes", result.device_bytes},
            {"device_milliseconds", result.device},
            {"passes", Json::array()}};
    add_times(json, "", result.total);
    add_times(json, "ceiling_blend_", result.ceiling_blend);
    for (const PassResult& pass : result.passes) json["passes"].push_back(pass_json(result, pass));
    if (!result.checks.empty()) json["checks"] = result.checks;
    if (!result.note.empty()) json["note"] = result.note;
}

void to_json(Json& json, const Scaling& scaling) {
    json = {{"of", scaling.of},
            {"against", scaling.against},
            {"exponent", scaling.exponent},
            {"residual", scaling.residual},
            {"points", scaling.points}};
}

void to_json(Json& json, const Result& result) {
    const DeviceInfo& device = result.device;
    const Host& host = result.host;
    json = {{"schema", "ewa-bench-1"},
            {"version", result.version},
            {"device",
             {{"name", device.name},
              {"type", device.type},
              {"driver", device.driver},
              {"api_version", device.api_version},
              {"subgroup_size", device.subgroup_size},
              {"memory_bytes", device.memory_bytes}}},
            {"host",
             {{"cpu", host.cpu},
              {"threads", host.threads},
              {"vectors", host.vectors},
              {"load", host.load},
              {"copy_gigabytes_per_second", host.copies.wall},
              {"copy_gigabytes_per_second_cpu", host.copies.cpu}}},
            {"cases", result.cases},
            {"scaling", result.scaling}};
}

namespace {

/// "850", "12.3 k", "4.56 M", "7.89 G".
std::string scaled(double value) {
    const char* units[] = {"", " k", " M", " G", " T"};
    int unit = 0;
    for (; value >= 999.5 && unit < 4; ++unit) value /= 1000;
    return text_of("%.3g%s", value, units[unit]);
}

std::string share_text(double part, double whole) {
    return part > 0 && whole > 0 ? text_of("%5.1f %%", 100 * part / whole) : "      -";
}

std::string pass_line(const CaseResult& result, const PassResult& pass) {
    const Spread &wall = pass.time.wall, &cpu = pass.time.cpu;
    // On a busy machine, the CPU time of a CPU device is more precise.
    const double best = cpu.samples > 0 ? cpu.median : wall.median;
    std::string line =
        text_of("  %-22s %9.3f +- %5.1f %%", pass.name.c_str(), wall.median, 100 * relative_noise(wall));
    line += cpu.samples > 0 ? text_of(" %9.3f +- %5.1f %%", cpu.median, 100 * relative_noise(cpu))
                            : std::string(20, ' ');
    line += text_of("  %s  %s  %s", share_text(wall.median, result.device.median).c_str(),
                    share_text(pass.ceiling.wall.median, wall.median).c_str(),
                    share_text(pass.ceiling.cpu.median, cpu.median).c_str());
    if (pass.name.starts_with("blend") && result.pairs_evaluated > 0 && best > 0)
        line +=
            text_of("  %s pairs/s, %s blended", scaled(double(result.pairs_evaluated) / best * 1e3).c_str(),
                    scaled(double(result.pairs_blended) / best * 1e3).c_str());
    else if (pass.bytes > 0 && best > 0)
        line += text_of("  %.2f GB/s", pass.bytes / best * 1e-6);
    return line + "\n";
}

std::string total_line(const char* name, const Timed& timed) {
    std::string line =
        text_of("  %-22s %9.3f +- %5.1f %%", name, timed.wall.median, 100 * relative_noise(timed.wall));
    if (timed.cpu.samples > 0)
        line += text_of(" %9.3f +- %5.1f %%", timed.cpu.median, 100 * relative_noise(timed.cpu));
    return line + text_of("  quartiles %.3f to %.3f, least %.3f, of %d\n", timed.wall.low, timed.wall.high,
                          timed.wall.least, timed.wall.samples);
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

std::string header_text(const Result& result) {
    const Host& host = result.host;
    return text_of("ewa %s on %s (%s, %u lanes)\nhost: %s, %u threads, %s, copies %.1f GB/s, load %.1f\n",
                   result.version.c_str(), result.device.name.c_str(), result.device.driver.c_str(),
                   result.device.subgroup_size, host.cpu.c_str(), host.threads, host.vectors.c_str(),
                   host.copies.wall, host.load);
}

std::string case_text(const CaseResult& result) {
    std::string text = text_of("\n%s\n", result.one.name.c_str());
    if (result.instances > 0)
        text += text_of("  %s instances, %s pairs evaluated, %s blended, %sB on the device\n",
                        scaled(result.instances).c_str(), scaled(double(result.pairs_evaluated)).c_str(),
                        scaled(double(result.pairs_blended)).c_str(),
                        scaled(double(result.device_bytes)).c_str());
    text += text_of("  %-22s %9s %9s %9s %9s  %7s  %7s  %7s\n", "ms", "wall", "",
                    result.total.cpu.samples > 0 ? "CPU" : "", "", "of all", "of host", "by CPU");
    for (const PassResult& pass : result.passes) text += pass_line(result, pass);
    if (result.device.samples > 0) text += total_line("all passes", {result.device, {}});
    if (result.one.kind != Kind::first_step) text += total_line("with the host's part", result.total);
    if (result.ceiling_blend.wall.samples > 0) text += total_line("blend on the host", result.ceiling_blend);
    for (const Check& check : result.checks)
        text += text_of("  %s %-52s %.3g (at most %.3g)\n", check.good() ? "good " : "WRONG",
                        check.what.c_str(), check.error, check.bound);
    if (!result.note.empty()) text += text_of("  %s\n", result.note.c_str());
    return text;
}

std::string scaling_text(const std::vector<Scaling>& scaling) {
    std::string text;
    for (const Scaling& one : scaling)
        text += text_of("  %-34s time ~ %s^%.3f  (%d cases, residual %.0f %%)\n", one.of.c_str(),
                        one.against.c_str(), one.exponent, one.points, 100 * one.residual);
    return text.empty() ? text : text_of("\nscaling\n%s", text.c_str());
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
        throw InputError("not results of the benchmark: " + std::string(core::plain_reason(error.what())));
    }
}

}  // namespace ewa::bench
