// SPDX-License-Identifier: Apache-2.0
#include "core/progress.h"

#include <unistd.h>

#include <array>
#include <cstdio>
#include <utility>

#include "core/text.h"

namespace ewa::core {

namespace {

constexpr std::chrono::milliseconds kRedraw{100};
constexpr double kWindowSeconds = 2;

double seconds(std::chrono::steady_clock::duration time) {
    return std::chrono::duration<double>(time).count();
}

std::string three_digits(double value) {
    std::array<char, 32> text{};
    std::snprintf(text.data(), text.size(), "%.3g", value);
    return text.data();
}

}  // namespace

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
    std::string line = what_;
    line.append(" ").append(std::to_string(done)).append("/").append(std::to_string(total_));
    line.append(" ").append(unit_);
    if (!details.empty()) line.append(", ").append(details);
    if (rate_ > 0) line.append(", ").append(three_digits(rate_)).append(" ").append(unit_).append("/s");
    if (rate_ > 0 && done < total_)
        line.append(", ").append(duration_text((total_ - done) / rate_)).append(" left");

    clear();
    std::fputs(line.c_str(), stdout);
    if (terminal_)
        drawn_ = true;
    else
        std::fputc('\n', stdout);
    std::fflush(stdout);
}

void Progress::note(const std::string& line) {
    if (quiet_) return;
    clear();
    std::puts(one_line(line).c_str());
    std::fflush(stdout);
}

void Progress::clear() {
    if (drawn_) std::fputs("\r\033[K", stdout);
    drawn_ = false;
}

}  // namespace ewa::core
