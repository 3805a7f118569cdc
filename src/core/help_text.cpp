// SPDX-License-Identifier: Apache-2.0
#include "core/help_text.h"

#include <algorithm>

namespace ewa::core {

std::string help_text(std::string_view text, size_t column) {
    constexpr size_t kWidth = 80;
    std::string result;
    while (!text.empty()) {
        const size_t end = std::min(text.find('\n'), text.size());
        std::string line(text.substr(0, end));
        text.remove_prefix(std::min(end + 1, text.size()));
        const size_t comma = line.find(",--");
        if (line.starts_with("  -") && comma != std::string::npos && comma < column) {
            // The blank takes the place of one of those before the description.
            const size_t gap = line.find("  ", comma);
            if (gap != std::string::npos) line.erase(gap, 1);
            line.insert(comma + 1, 1, ' ');
        }
        const bool described = line.size() > column && line[column - 1] == ' ' && line[0] == ' ';
        const size_t begin = std::min(line.find_first_not_of(' '), line.size());
        const std::string indent(described ? column : begin, ' ');
        while (line.size() > kWidth) {
            const size_t blank = line.rfind(' ', kWidth);
            if (blank == std::string::npos || blank <= indent.size()) break;
            result += line.substr(0, blank) + "\n";
            line = indent + line.substr(blank + 1);
        }
        result += line + "\n";
    }
    return result;
}

}  // namespace ewa::core
