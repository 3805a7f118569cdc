// SPDX-License-Identifier: Apache-2.0
#include "bench/report.h"

#include <cstdarg>
#include <cstdio>

namespace ewa::bench {
namespace {

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

}  // namespace

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

std::string scaled(double value) {
    const char* units[] = {"", " k", " M", " G", " T"};
    int unit = 0;
    for (; value >= 999.5 && unit < 4; ++unit) value /= 1000;
    return text_of("%.3g%s", value, units[unit]);
}

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

}  // namespace ewa::bench
