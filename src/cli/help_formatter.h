// SPDX-License-Identifier: Apache-2.0
// Help that fits a terminal of 80 columns without breaking a word.
#pragma once
#include <CLI/CLI.hpp>
#include <algorithm>
#include <sstream>
#include <string>

namespace ewa::cli {

class HelpFormatter : public CLI::Formatter {
  public:
    std::string make_option(const CLI::Option* option, bool is_positional) const override {
        return entry(make_option_name(option, is_positional) + make_option_opts(option),
                     make_option_desc(option));
    }
    std::string make_subcommand(const CLI::App* command) const override {
        return entry(command->get_name(), command->get_description());
    }
    std::string make_description(const CLI::App* app) const override {
        return wrapped(Formatter::make_description(app), 0, 0);
    }

  private:
    static constexpr size_t kColumns = 80, kTextColumn = 30;

    /// The words of the text in lines of at most kColumns. `column`: where the first line continues. `indent`: of
    /// the other lines.
    static std::string wrapped(const std::string& text, size_t column, size_t indent) {
        std::istringstream words(text);
        std::string lines;
        bool first = true;
        for (std::string word; words >> word; first = false) {
            if (!first && column + 1 + word.size() > kColumns) {
                lines += '\n' + std::string(indent, ' ');
                column = indent;
            } else if (!first) {
                lines += ' ';
                ++column;
            }
            lines += word;
            column += word.size();
        }
        return lines + '\n';
    }

    static std::string entry(const std::string& name, const std::string& description) {
        std::string head = "  " + name;
        if (head.size() + 2 > kTextColumn)
            head += '\n' + std::string(kTextColumn, ' ');
        else
            head.resize(kTextColumn, ' ');
        return head + wrapped(description, kTextColumn, kTextColumn);
    }
};

}  // namespace ewa::cli
