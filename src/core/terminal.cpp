// SPDX-License-Identifier: Apache-2.0
#include "core/terminal.h"

#include <algorithm>
#include <cstdio>

#include "core/text.h"
#include "platform/terminal.h"

namespace ewa::core {

size_t terminal_columns() {
    constexpr size_t kUnknown = 80;
    const size_t columns = platform::terminal_columns();
    return columns == 0 ? kUnknown : columns;
}

size_t terminal_width() {
    constexpr size_t kLeast = 40, kMost = 120;
    return std::clamp<size_t>(terminal_columns(), kLeast, kMost);
}

std::string wrapped_help(std::string_view text, size_t column, size_t width) {
    std::string result;
    while (!text.empty()) {
        const size_t end = std::min(text.find('\n'), text.size());
        std::string line(text.substr(0, end));
        text.remove_prefix(std::min(end + 1, text.size()));
        if (line.empty() && result.ends_with("\n\n")) continue;
        for (size_t comma = line.find(",--"); line.starts_with("  -") && comma < column;
             comma = line.find(",--", comma + 1)) {
            // The blank takes the place of one of those before the description.
            const size_t gap = line.find("  ", comma);
            if (gap != std::string::npos) line.erase(gap, 1);
            line.insert(comma + 1, 1, ' ');
        }
        const bool described = line.size() > column && line[column - 1] == ' ' && line[0] == ' ';
        const size_t begin = std::min(line.find_first_not_of(' '), line.size());
        const std::string indent(described ? column : begin, ' ');
        while (line.size() > width) {
            const size_t blank = line.rfind(' ', width);
            if (blank == std::string::npos || blank <= indent.size()) break;
            result += line.substr(0, blank) + "\n";
            line = indent + line.substr(blank + 1);
        }
        result += line + "\n";
    }
    return result;
}

std::string first_sentence(std::string_view text) {
    const size_t end = text.find(". ");
    return std::string(text.substr(0, end));
}

std::string help_text(std::string_view text, size_t column) {
    return wrapped_help(text, column, terminal_width());
}

bool print_whole(std::string_view text) {
    return std::fwrite(text.data(), 1, text.size(), stdout) == text.size() && std::fflush(stdout) == 0;
}

}  // namespace ewa::core
