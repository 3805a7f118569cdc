#include "bench/report.h"
#include "bench/text.h"

namespace ewa::bench {
namespace {

std::string pass_line(const CaseResult& result, const PassResult& pass) {
    const double median = pass.milliseconds.median;
    std::string line = text_of("  %-26s %9.3f ms  +- %5.1f %%", pass.name.c_str(), median,
                               100 * relative_noise(pass.milliseconds));
    if (result.device.median > 0) line += text_of("  %5.1f %% of all", 100 * median / result.device.median);
    if (pass.ceiling > 0 && median > 0)
        line += text_of("  %5.1f %% of the host", 100 * pass.ceiling / median);
    if (pass.name.starts_with("blend") && result.pairs_evaluated > 0 && median > 0)
        line +=
            text_of("  %s pairs/s, %s blended", scaled(double(result.pairs_evaluated) / median * 1e3).c_str(),
                    scaled(double(result.pairs_blended) / median * 1e3).c_str());
    else if (pass.bytes > 0 && median > 0)
        line += text_of("  %.2f GB/s", pass.bytes / median * 1e-6);
    return line + "\n";
}

std::string total_line(const char* name, const Spread& spread) {
    return text_of("  %-26s %9.3f ms  +- %5.1f %%  quartiles %.3f to %.3f, least %.3f, of %d\n", name,
                   spread.median, 100 * relative_noise(spread), spread.low, spread.high, spread.least,
                   spread.samples);
}

}  // namespace

std::string header_text(const Result& result) {
    const Host& host = result.host;
    return text_of("ewa %s on %s (%s, %u lanes)\nhost: %s, %u threads, %s, copies %.1f GB/s, load %.1f\n",
                   result.version.c_str(), result.device.name.c_str(), result.device.driver.c_str(),
                   result.device.subgroup_size, host.cpu.c_str(), host.threads, host.vectors.c_str(),
                   host.copy_bandwidth, host.load);
}

std::string case_text(const CaseResult& result) {
    std::string text = text_of("\n%s\n", result.one.name.c_str());
    if (result.instances > 0)
        text += text_of("  %s instances, %s pairs evaluated, %s blended, %sB on the device\n",
                        scaled(result.instances).c_str(), scaled(double(result.pairs_evaluated)).c_str(),
                        scaled(double(result.pairs_blended)).c_str(),
                        scaled(double(result.device_bytes)).c_str());
    for (const PassResult& pass : result.passes) text += pass_line(result, pass);
    if (result.device.samples > 0) text += total_line("all passes", result.device);
    if (result.one.kind != Kind::first_step) text += total_line("wall", result.wall);
    if (result.cpu.samples > 0) text += total_line("CPU time of all threads", result.cpu);
    if (result.ceiling_blend.samples > 0) {
        text += total_line("blend on the host", result.ceiling_blend);
        text.back() = ' ';
        text += text_of(" %s pairs/s\n",
                        scaled(double(result.pairs_evaluated) / result.ceiling_blend.median * 1e3).c_str());
    }
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
