// SPDX-License-Identifier: Apache-2.0
// The progress of long work, with its rate and the time left.
#pragma once
#include <chrono>
#include <string>

namespace ewa::core {

/// Progress of long work: one line that is redrawn on a terminal, or a line per tenth of the work in a file.
class Progress {
  public:
    /// what: a verb such as "rendered". unit: the plural of a unit of work, such as "steps". quiet: print
    /// nothing.
    Progress(std::string what, int total, std::string unit, bool quiet);
    ~Progress();

    /// details: more text for the line, such as the loss.
    void update(int done, const std::string& details = "");

    /// Prints a line that stays, above the progress line.
    void note(const std::string& line);

    /// Removes the progress line from the terminal until the next update: other output may follow.
    void clear();

    /// Whether update(done) would print: details may be costly to compute.
    bool due(int done) const;

  private:
    using Clock = std::chrono::steady_clock;
    std::string what_, unit_;
    int total_, next_tenth_ = 1;
    bool quiet_, terminal_, drawn_ = false;
    Clock::time_point start_ = Clock::now(), printed_{};
    // Start of the interval that the rate is measured over.
    Clock::time_point window_start_ = start_;
    int window_done_ = 0;
    double rate_ = 0;
};

}  // namespace ewa::core
