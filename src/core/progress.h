// SPDX-License-Identifier: Apache-2.0
// The progress of long work, with its rate and the time left.
#pragma once
#include <chrono>
#include <optional>
#include <string>
#include <vector>

namespace ewa::core {

/// Estimates the time left of work in units of about equal length, from the times at which units were done. The estimate takes
/// the mean time of units done in the later half of the time so far. A current unit that takes longer lengthens it.
class Pace {
  public:
    /// seconds: the time at the start. done: the number of units that were already done at that time.
    explicit Pace(double seconds = 0, double done = 0) : marks_{{seconds, done}} {}
    void add(double seconds, double done);
    /// Seconds until `total` units are done. Empty until a unit is done.
    std::optional<double> left(double seconds, double total) const;
    double rate() const;  // units a second; 0 until a unit is done

  private:
    struct Mark {
        double seconds, done;
    };
    const Mark& base() const;

    std::vector<Mark> marks_;
};

/// The progress that a terminal shows.
struct ProgressLine {
    double share = 0;            // of the time, 0 to 1
    std::optional<double> left;  // s
    std::string text;            // ASCII
};

/// The line for a terminal: a bar, the share, the time left and the text, cut to `columns` - 1 columns. A narrow terminal gets no
/// bar. unicode: the bar consists of box drawing characters in place of # and -.
std::string drawn(const ProgressLine& line, size_t columns, bool unicode);

/// Prints the progress of long work. On a terminal, one line is redrawn. In a file, or on a terminal without cursor movement
/// (TERM=dumb), each tenth of the work prints a line.
class Progress {
  public:
    /// what: a verb such as "rendered". unit: the plural of a unit of work, such as "steps". quiet: print
    /// nothing.
    Progress(std::string what, int total, std::string unit, bool quiet);
    ~Progress();

    /// Begins the next part of the work. The bar and the time left are those of all parts together.
    void begin(std::string what, int total, std::string unit);
    /// Changes the number of units of this part.
    void set_total(int total);
    /// This part's units up to `done` were done before it began.
    void skip(int done);
    /// Sets the seconds that this part still takes, instead of the estimate by its pace. They count down until the next call.
    /// Empty: unknown.
    void set_left(std::optional<double> seconds);
    /// Sets the seconds that all later parts will take.
    void set_rest(double seconds) { rest_ = seconds; }

    /// details: more text for the line, such as the loss.
    void update(int done, const std::string& details = "");

    /// Prints a line that stays, above the progress line.
    void note(const std::string& line);

    /// Removes the progress line from the terminal until the next update: other output may follow.
    void clear();

    /// Whether update(done) would print: details may be costly to compute.
    bool due(int done) const;

    /// Seconds since this part began.
    double seconds() const;

  private:
    using Clock = std::chrono::steady_clock;
    std::optional<double> left_now() const;

    std::string what_, unit_;
    int total_, next_tenth_ = 1, printed_done_ = -1;
    bool quiet_, terminal_, drawn_ = false, parts_ = false;
    Clock::time_point start_ = Clock::now(), part_start_ = start_, printed_{};
    Pace pace_;
    std::optional<double> left_;  // of this part, at left_set_
    double left_set_ = -1;        // -1: the pace says how long this part takes
    double rest_ = 0, share_ = 0;
};

}  // namespace ewa::core
