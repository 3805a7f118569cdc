// SPDX-License-Identifier: Apache-2.0
#include "capture/colmap_program.h"

#include <algorithm>

#include "core/process.h"
#include "core/text.h"
#include "ewa/error.h"

namespace ewa::capture {
namespace {

constexpr size_t kMostLine = 4096;  // bytes; COLMAP's own are shorter
constexpr const char* kNoDisplay = "QT_QPA_PLATFORM=offscreen";

}  // namespace

std::string Colmap::log_name() const {
    return core::one_line(log().string());
}

bool Colmap::has_option(const std::string& command, const std::string& option) const {
    std::vector<std::string> words = words_;
    words.insert(words.end(), {command, "--help"});
    const core::Answer help =
        core::ask_program({.command = std::move(words), .environment = {kNoDisplay}, .log = log()},
                          [&] { return progress_({}); });
    if (help.ended == core::Ended::stopped) throw Stopped();
    if (help.cut && help.text.empty()) throw RunError("colmap " + command + " --help gives no answer");
    return help.text.find("--" + option + " ") != std::string::npos;
}

std::string Colmap::options_of_matching(const std::string& command) const {
    return has_option(command, "FeatureMatching.use_gpu") ? "--FeatureMatching." : "--SiftMatching.";
}

std::string Colmap::options_of_solver() const {
    const std::string own = "BundleAdjustmentCeres.";
    return has_option("bundle_adjuster", own + "max_num_iterations") ? "--" + own : "--BundleAdjustment.";
}

void Colmap::run(std::vector<std::string> command, const CaptureProgress& start,
                 const std::function<std::optional<int>(const std::string&)>& done) const {
    CaptureProgress now = start;
    std::string rest;
    std::string name = command[0];
    if (name == "colmap") {
        name += " " + command[1];
        command.erase(command.begin());
        command.insert(command.begin(), words_.begin(), words_.end());
    }
    const core::Ended ended = core::run_program(
        {.command = std::move(command),
         .environment = {kNoDisplay},
         .log = log(),
         .output_to_log = true,
         .joined = true},  // COLMAP 3.9 reports on standard error
        [&](std::string_view piece) {
            for (size_t end; (end = piece.find('\n')) != std::string::npos; piece.remove_prefix(end + 1)) {
                rest += piece.substr(0, end);
                now.done = std::max(now.done, std::min(done(rest).value_or(0), now.total));
                rest.clear();
            }
            if (rest.size() < kMostLine) rest += piece;
            return progress_(now);
        });
    if (ended == core::Ended::stopped) throw Stopped();
    if (ended == core::Ended::failed) throw RunError(name + " failed; " + log_name() + " has its reason");
}

void Colmap::say(const std::string& line) const {
    CaptureProgress now;
    now.note = line;
    if (!progress_(now)) throw Stopped();
}

std::optional<std::pair<int, int>> numbers_in(const std::string& line, const std::regex& pattern) {
    std::smatch found;
    if (!std::regex_search(line, found, pattern)) return {};
    const auto number = [&](size_t i) {
        return found[i].matched ? core::parse_integer<int>(found[i].str()).value_or(0) : 0;
    };
    return std::pair(number(1), number(2));
}

std::string argument(const std::filesystem::path& path) {
    return std::filesystem::absolute(path).string();
}

}  // namespace ewa::capture
