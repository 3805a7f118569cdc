// SPDX-License-Identifier: Apache-2.0
// Runs COLMAP and GLOMAP: their log, their options, and the progress that their output states.
#pragma once
#include <filesystem>
#include <functional>
#include <optional>
#include <regex>
#include <string>
#include <utility>
#include <vector>

#include "capture/found_colmap.h"
#include "capture/steps.h"

namespace ewa::capture {

/// Runs COLMAP, writes its log, and reports its progress.
class Colmap {
  public:
    /// python: as CaptureOptions::python. Throws RunError if there is no COLMAP.
    Colmap(std::filesystem::path work, const std::filesystem::path& python, const ProgressFunction& progress)
        : words_(require_colmap(python).words), work_(std::move(work)), progress_(progress) {}

    std::filesystem::path log() const { return work_ / "log.txt"; }
    std::string log_name() const;

    /// Whether COLMAP's help for a command lists an option. Options' names differ between releases.
    bool has_option(const std::string& command, const std::string& option) const;

    /// The prefix in the names of a matcher's options. COLMAP 3.13 has another than earlier releases.
    std::string options_of_matching(const std::string& command) const;

    /// The prefix in the names of the solver's options of bundle_adjuster. COLMAP 4 has another than earlier releases.
    std::string options_of_solver() const;

    /// Runs a program, where "colmap" is the COLMAP that was found. done(line): the number of finished units that a line of the output
    /// states, or nothing. Throws RunError, Stopped.
    void run(std::vector<std::string> command, const CaptureProgress& start,
             const std::function<std::optional<int>(const std::string&)>& done) const;

    /// Gives the user a line through the progress function.
    void say(const std::string& line) const;

  private:
    std::vector<std::string> words_;
    std::filesystem::path work_;
    const ProgressFunction& progress_;
};

/// Reads two numbers of a line, such as those of "Matching image [3/50]".
std::optional<std::pair<int, int>> numbers_in(const std::string& line, const std::regex& pattern);

/// The path in a form that no program takes for an option.
std::string argument(const std::filesystem::path& path);

}  // namespace ewa::capture
