// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "bench/format_figures.h"
#include "bench/report.h"
#include "ewa/error.h"

namespace ewa::bench {
namespace {

constexpr double kSigmas = 3;  // how many standard deviations of the ratio are still noise
// Runs of one program differ by this much between two processes whatever the spread within each says.
constexpr double kSmallest = 0.05;
constexpr double kSmallestMilliseconds = 0.1;

const Json* named(const Json& list, const std::string& name) {
    for (const Json& one : list)
        if (one.at("name") == name) return &one;
    return nullptr;
}

/// The spread under a key, of no samples where there is none.
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

/// prefix: of the keys of the wall and the processor time.
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

std::string compare_text(const Json& old_results, const Json& new_results) {
    try {
        if (old_results.at("schema") != new_results.at("schema"))
            throw InputError("results of schema " + old_results.at("schema").dump() +
                             " cannot be compared with those of " + new_results.at("schema").dump());
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
