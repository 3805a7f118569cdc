// SPDX-License-Identifier: Apache-2.0
// How far a long work is: a line that is redrawn on a terminal, a line for every tenth elsewhere.
#pragma once
#include <chrono>
#include <string>

namespace ewa::cli {

class Progress {
  public:
    /// total: units of work, of which `unit` is the plural ("steps"). quiet: prints nothing at all.
    Progress(std::string what, int total, std::string unit, bool quiet);
    ~Progress();

    /// details: what else the line shows, e.g. the loss.
    void update(int done, const std::string& details = "");

    /// A line of its own that stays; the progress line goes on below it.
    void note(const std::string& line);

    /// Whether update(done) would print, for details that cost something to make.
    bool due(int done) const;

  private:
    using Clock = std::chrono::steady_clock;
    std::string what_, unit_;
    int total_, next_tenth_ = 1;
    bool quiet_, terminal_, drawn_ = false;
    Clock::time_point start_ = Clock::now(), printed_{};
    // The rate of the recent past: (time, done) of a while ago.
    Clock::time_point window_start_ = start_;
    int window_done_ = 0;
    double rate_ = 0;

    void clear_line();
};

}  // namespace ewa::cli
