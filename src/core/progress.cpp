// SPDX-License-Identifier: Apache-2.0
#include "core/progress.h"

#include <algorithm>
#include <array>
#include <cstdio>
#include <utility>

#include "core/terminal.h"
#include "core/text.h"
#include "platform/terminal.h"

namespace ewa::core {

namespace {

constexpr std::chrono::milliseconds kRedraw{100};
constexpr size_t kMostMarks = 64;
constexpr size_t kLeastForBar = 48, kLeastBar = 8, kMostBar = 30;  // columns

std::string three_digits(double value) {
    std::array<char, 32> text{};
    std::snprintf(text.data(), text.size(), "%.3g", value);
    return text.data();
}

std::string bar(double share, size_t cells, bool unicode) {
    const auto filled = size_t(std::clamp(share, 0.0, 1.0) * double(cells) + 1e-9);
    std::string text;
    for (size_t i = 0; i < cells; ++i)
        text += i < filled ? (unicode ? "\u2501" : "#") : unicode ? "\u2500" : "-";
    return text;
}

}  // namespace

void Pace::add(double seconds, double done) {
    if (done <= marks_.back().done) return;
    marks_.push_back({seconds, done});
    if (marks_.size() <= kMostMarks) return;
    // Every second one, and the last.
    for (size_t i = 0; 2 * i < marks_.size(); ++i) marks_[i] = marks_[2 * i];
    marks_.resize((marks_.size() + 1) / 2);
}

/// The last mark in the earlier half of the time.
const Pace::Mark& Pace::base() const {
    const double half = (marks_.front().seconds + marks_.back().seconds) / 2;
    const auto after =
        std::find_if(marks_.begin() + 1, marks_.end(), [&](const Mark& mark) { return mark.seconds > half; });
    return *(after - 1);
}

double Pace::rate() const {
    if (marks_.size() < 2) return 0;
    const double span = marks_.back().seconds - base().seconds;
    return span > 0 ? (marks_.back().done - base().done) / span : 0;
}

std::optional<double> Pace::left(double seconds, double total) const {
    const double known = rate();
    if (known <= 0) return {};
    const double done = marks_.back().done, since = seconds - marks_.back().seconds;
    const double unit = std::max(1 / known, (seconds - base().seconds) / (done - base().done + 1));
    return std::max(0.0, (total - done) * unit - std::min(since, unit));
}

std::string drawn(const ProgressLine& line, size_t columns, bool unicode) {
    std::array<char, 8> percent{};
    std::snprintf(percent.data(), percent.size(), "%3d %%", int(100 * std::clamp(line.share, 0.0, 1.0)));
    std::string text = percent.data();
    if (line.left) text += "  " + duration_text(*line.left) + " left";
    text += "  " + line.text;
    if (columns < kLeastForBar) return text.substr(0, columns > 1 ? columns - 1 : 0);
    const size_t cells = std::clamp(columns / 5, kLeastBar, kMostBar);
    return bar(line.share, cells, unicode) + " " + text.substr(0, columns - cells - 2);
}

Progress::Progress(std::string what, int total, std::string unit, bool quiet)
    : what_(std::move(what)),
      unit_(std::move(unit)),
      total_(total),
      quiet_(quiet),
      terminal_(platform::redraws()) {}

Progress::~Progress() {
    if (drawn_) std::fputc('\n', stdout);
}

double Progress::seconds() const {
    return std::chrono::duration<double>(Clock::now() - part_start_).count();
}

void Progress::begin(std::string what, int total, std::string unit) {
    what_ = std::move(what);
    unit_ = std::move(unit);
    total_ = total;
    parts_ = true;
    part_start_ = Clock::now();
    printed_ = {};
    next_tenth_ = 1;
    printed_done_ = -1;
    pace_ = Pace();
    left_.reset();
    left_set_ = -1;
    rest_ = 0;
}

void Progress::skip(int done) {
    pace_ = Pace(seconds(), done);
}

void Progress::set_total(int total) {
    total_ = total;
    if (total > 0) next_tenth_ = int(10LL * std::max(0, printed_done_) / total) + 1;
}

void Progress::set_left(std::optional<double> seconds_left) {
    left_ = seconds_left;
    left_set_ = seconds();
}

bool Progress::due(int done) const {
    if (quiet_) return false;
    if (terminal_) return done == total_ || Clock::now() - printed_ >= kRedraw;
    return done != printed_done_ &&
           (done == total_ || 10LL * done >= static_cast<long long>(total_) * next_tenth_);
}

/// The time left of all parts.
std::optional<double> Progress::left_now() const {
    if (left_) return std::max(0.0, *left_ - (seconds() - left_set_)) + rest_;
    if (const auto left = left_set_ < 0 ? pace_.left(seconds(), total_) : std::nullopt) return *left + rest_;
    return {};
}

void Progress::update(int done, const std::string& details) {
    pace_.add(seconds(), done);
    if (!due(done)) return;
    printed_ = Clock::now();
    printed_done_ = done;
    next_tenth_ = static_cast<int>(10LL * done / total_) + 1;

    const bool last = done >= total_ && rest_ <= 0;
    ProgressLine line;
    if (!last) line.left = left_now();
    const double passed = std::chrono::duration<double>(printed_ - start_).count();
    if (last)
        share_ = 1;
    else if (!parts_ && !left_)
        share_ = double(done) / total_;
    else if (line.left)
        share_ = passed / std::max(1e-9, passed + *line.left);
    line.share = share_;
    const double rate = pace_.rate();
    line.text = what_;
    line.text.append(" ").append(std::to_string(done)).append("/").append(std::to_string(total_));
    line.text.append(" ").append(unit_);
    if (!details.empty()) line.text.append(", ").append(details);
    if (rate > 0) line.text.append(", ").append(three_digits(rate)).append(" ").append(unit_).append("/s");

    clear();
    if (terminal_) {
        std::fputs(drawn(line, terminal_columns(), platform::shows_unicode()).c_str(), stdout);
        drawn_ = true;
    } else {
        if (line.left) line.text.append(", ").append(duration_text(*line.left)).append(" left");
        std::puts(line.text.c_str());
    }
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
