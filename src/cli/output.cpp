// SPDX-License-Identifier: Apache-2.0
#include "cli/output.h"

#include <spdlog/fmt/fmt.h>
#include <unistd.h>
#include <nlohmann/json.hpp>

#include <cerrno>
#include <cstdio>
#include <map>
#include <system_error>

#include "core/atomic_file.h"
#include "core/messages.h"
#include "core/text.h"
#include "ewa/error.h"

namespace ewa::cli {

namespace fs = std::filesystem;

namespace {

constexpr std::chrono::milliseconds kRedraw{100};
constexpr double kWindowSeconds = 2;

double seconds(std::chrono::steady_clock::duration time) {
    return std::chrono::duration<double>(time).count();
}

/// As make_folder says it.
[[noreturn]] void no_folder(const fs::path& folder, const std::error_code& error) {
    throw RunError("cannot create the folder " + folder.string() + ": " + error.message());
}

/// The path without links and dots. The file need not exist.
fs::path resolved(const fs::path& path) {
    std::error_code error;
    const fs::path whole = fs::weakly_canonical(fs::absolute(path, error), error);
    return error ? path.lexically_normal() : whole;
}

}  // namespace

void check_writable(const fs::path& file, Folder made) {
    if (file.empty()) return;
    const fs::path folder = file.parent_path();
    std::error_code error;
    if (made == Folder::there || folder.empty() || fs::exists(folder, error)) {
        const core::AtomicFile probe(file);  // removed again: nothing is committed
        return;
    }
    fs::path above = folder;
    while (!above.empty() && !fs::exists(above, error)) above = above.parent_path();
    if (above.empty()) above = ".";
    if (!fs::is_directory(above, error)) no_folder(folder, std::make_error_code(std::errc::not_a_directory));
    if (access(above.c_str(), W_OK | X_OK) != 0)
        no_folder(folder, std::error_code(errno, std::generic_category()));
}

void keep_apart(const std::vector<NamedFile>& written, const std::vector<NamedFile>& others) {
    std::map<fs::path, const NamedFile*> there;
    for (const NamedFile& other : others)
        if (!other.path.empty()) there.emplace(resolved(other.path), &other);
    for (const NamedFile& file : written) {
        if (file.path.empty()) continue;
        const auto [taken, is_new] = there.emplace(resolved(file.path), &file);
        if (!is_new)
            throw InputError(core::one_line(file.name + " " + file.path.string() + " is the same file as " +
                                            taken->second->name + "; it would be overwritten"));
    }
}

void print_json(const report::Json& json) {
    fmt::print("{}\n", json.dump(2, ' ', false, report::Json::error_handler_t::replace));
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
