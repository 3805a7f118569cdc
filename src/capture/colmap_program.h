// SPDX-License-Identifier: Apache-2.0
// COLMAP and GLOMAP as programs: their log, their options, and the meaning of their lines.
#pragma once
#include <filesystem>
#include <functional>
#include <optional>
#include <regex>
#include <string>
#include <utility>
#include <vector>

#include "capture/steps.h"

namespace ewa::capture {

/// COLMAP with its log and the meaning of its lines.
class Colmap {
  public:
    Colmap(std::filesystem::path work, const ProgressFunction& progress)
        : work_(std::move(work)), progress_(progress) {}

    std::filesystem::path log() const { return work_ / "log.txt"; }
    std::string log_name() const;

    /// Whether the help of a command has an option: their names differ between releases.
    bool has_option(const std::string& command, const std::string& option) const;

    /// The prefix of a matcher's options, which COLMAP 3.13 has renamed.
    std::string options_of_matching(const std::string& command) const;

    /// Runs a program. done(line): the number of finished units after this line of the output, if it says so. Throws RunError,
    /// Stopped.
    void run(std::vector<std::string> command, const CaptureProgress& start,
             const std::function<std::optional<int>(const std::string&)>& done) const;

    /// A line for the user.
    void say(const std::string& line) const;

  private:
    std::filesystem::path work_;
    const ProgressFunction& progress_;
};

/// Reads two numbers of a line, such as those of "Matching image [3/50]".
std::optional<std::pair<int, int>> numbers_in(const std::string& line, const std::regex& pattern);

/// A path that no program takes for an option.
std::string argument(const std::filesystem::path& path);

}  // namespace ewa::capture
