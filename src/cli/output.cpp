// SPDX-License-Identifier: Apache-2.0
#include "cli/output.h"

#include <spdlog/fmt/fmt.h>
#include <unistd.h>
#include <nlohmann/json.hpp>

#include <cstdio>

#include "core/messages.h"
#include "core/text.h"
#include "ewa/error.h"
#include "live/run_folder.h"

namespace ewa::cli {

namespace {

constexpr std::chrono::milliseconds kRedraw{100};
constexpr double kWindowSeconds = 2;

double seconds(std::chrono::steady_clock::duration time) {
    return std::chrono::duration<double>(time).count();
}

/// Adds the files of each run whose splats are read.
void add_run_files(std::vector<NamedFile>& read) {
    for (size_t i = 0, count = read.size(); i < count; ++i) {
        const auto run = live::run_of_splats(read[i].path);
        if (!run) continue;
        for (const char* name : live::kRunFiles) read.push_back({"a file of the run", run->folder / name});
    }
}

}  // namespace

void check_command_outputs(const std::vector<NamedFile>& written, std::vector<NamedFile> read) {
    for (const NamedFile& file : written)
        if (const auto run = live::run_of_file(file.path))
            throw InputError(core::one_line(file.name + " " + file.path.string() +
                                            " is a file of the training run in " + run->string() +
                                            "; it would be overwritten; name another file"));
    add_run_files(read);
    core::check_outputs(written, read);
}

void print_json(const report::Json& json) {
    fmt::print("{}\n", json.dump(2, ' ', false, report::Json::error_handler_t::replace));
}

void print_how_to_continue() {
    std::puts("interrupted; to continue, repeat the command");
}

Progress::Progress(std::string what, int total, std::string unit, bool quiet)
    : what_(std::move(what)),
      unit_(std::move(unit)),
      total_(total),
      quiet_(quiet),
      terminal_(isatty(STDOUT_FILENO)) {}

Progress::~Progress() {
    if (drawn_) std::fputc('\n', stdout);
}

bool Progress::due(int done) const {
    if (quiet_) return false;
    if (done == total_) return true;
    return terminal_ ? Clock::now() - printed_ >= kRedraw
                     : 10LL * done >= static_cast<long long>(total_) * next_tenth_;
}

void Progress::update(int done, const std::string& details) {
    if (!due(done)) return;
    const auto now = Clock::now();
    printed_ = now;
    next_tenth_ = static_cast<int>(10LL * done / total_) + 1;

    const double span = seconds(now - window_start_);
    if (span > 0 && done > window_done_) rate_ = (done - window_done_) / span;
    if (span >= kWindowSeconds) {
        window_start_ = now;
        window_done_ = done;
    }
    std::string line = fmt::format("{} {}/{} {}", what_, done, total_, unit_);
    if (!details.empty()) line += ", " + details;
    if (rate_ > 0) line += fmt::format(", {:.3g} {}/s", rate_, unit_);
    if (rate_ > 0 && done < total_) line += ", " + core::duration_text((total_ - done) / rate_) + " left";

    clear_line();
    std::fputs(line.c_str(), stdout);
    if (terminal_)
        drawn_ = true;
    else
        std::fputc('\n', stdout);
    std::fflush(stdout);
}

void Progress::note(const std::string& line) {
    if (quiet_) return;
    clear_line();
    std::puts(core::one_line(line).c_str());
    std::fflush(stdout);
}

void Progress::clear_line() {
    if (drawn_) std::fputs("\r\033[K", stdout);
    drawn_ = false;
}

}  // namespace ewa::cli
