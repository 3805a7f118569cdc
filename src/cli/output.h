// SPDX-License-Identifier: Apache-2.0
// What a command writes: files that the user asked for, JSON, and the progress of long work.
#pragma once
#include <chrono>
#include <string>
#include <vector>

#include "core/folders.h"
#include "core/json.h"
#include "core/outputs.h"
#include "report/summary.h"

namespace ewa::cli {

using core::make_folder;
using core::NamedFile;
using core::write_json;

/// core::check_outputs for every command but `ewa train`. It also refuses outputs that are files of a training run.
void check_command_outputs(const std::vector<NamedFile>& written, std::vector<NamedFile> read);

/// Prints the value with indentation. Bytes that are not UTF-8 become U+FFFD: text from a file may hold some.
void print_json(const report::Json& json);

/// Says how interrupted work goes on.
void print_how_to_continue();

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

    void clear_line();
};

}  // namespace ewa::cli
