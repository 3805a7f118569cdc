// SPDX-License-Identifier: Apache-2.0
// The format of --help: lines of at most 80 columns that break between words. Header only, so that ewa,
// ewa-view and ewa-bench share it without a library.
#pragma once
#include <CLI/CLI.hpp>
#include <memory>
#include <sstream>
#include <string>

namespace ewa::cli {

inline constexpr size_t kHelpColumns = 80, kHelpTextColumn = 30;

/// The line in lines of at most kHelpColumns, broken at spaces. The rest of an option's line, which begins
/// with a space, continues in the column of the descriptions. A word that is longer than a line keeps a line
/// of its own.
inline std::string wrapped(std::string line) {
    std::string text;
    const std::string indent(line.starts_with(' ') ? kHelpTextColumn : 2, ' ');
    while (line.size() > kHelpColumns) {
        const size_t first = line.find_first_not_of(' ');
        size_t at = line.rfind(' ', kHelpColumns);
        if (at == std::string::npos || at < first) at = line.find(' ', first);
        if (at == std::string::npos) break;
        text += line.substr(0, line.find_last_not_of(' ', at) + 1) + "\n";
        line = indent + line.substr(line.find_first_not_of(' ', at));
    }
    return text + line + "\n";
}

class HelpFormat : public CLI::Formatter {
  public:
    HelpFormat() { column_width(kHelpTextColumn); }

    std::string make_help(const CLI::App* app, std::string name, CLI::AppFormatMode mode) const override {
        std::istringstream lines(CLI::Formatter::make_help(app, std::move(name), mode));
        std::string text;
        for (std::string line; std::getline(lines, line);) text += wrapped(std::move(line));
        return text;
    }
};

/// Sub-commands inherit the format, so this comes before they are added.
inline void set_help_format(CLI::App& app) {
    app.formatter(std::make_shared<HelpFormat>());
}

}  // namespace ewa::cli
