// SPDX-License-Identifier: Apache-2.0
#include "bench/format_figures.h"

#include <cstdarg>
#include <cstdio>

namespace ewa::bench {

std::string text_of(const char* format, ...) {
    va_list arguments, again;
    va_start(arguments, format);
    va_copy(again, arguments);
    const int length = std::vsnprintf(nullptr, 0, format, arguments);
    std::string text(size_t(length > 0 ? length : 0), '\0');
    std::vsnprintf(text.data(), text.size() + 1, format, again);
    va_end(again);
    va_end(arguments);
    return text;
}

std::string scaled(double value) {
    const char* units[] = {"", " k", " M", " G", " T"};
    int unit = 0;
    for (; value >= 999.5 && unit < 4; ++unit) value /= 1000;
    return text_of("%.3g%s", value, units[unit]);
}

}  // namespace ewa::bench
