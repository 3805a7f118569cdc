// SPDX-License-Identifier: Apache-2.0
#include "core/messages.h"

#include <spdlog/fmt/fmt.h>
#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <cmath>
#include <memory>

#include "core/text.h"

namespace ewa::core {

std::string bytes_text(uint64_t bytes) {
    static constexpr const char* kUnits[] = {"B", "kB", "MB", "GB", "TB"};
    double value = static_cast<double>(bytes);
    int unit = 0;
    while (value >= 999.5 && unit < 4) {
        value /= 1000;
        ++unit;
    }
    return fmt::format("{:.3g} {}", value, kUnits[unit]);
}

std::string duration_text(double seconds) {
    if (!(seconds < 3.6e7)) return "very long";
    const long total = std::lround(std::max(0.0, seconds));
    if (total < 60) return fmt::format("{} s", total);
    if (total < 3600) return fmt::format("{} min {:02} s", total / 60, total % 60);
    return fmt::format("{} h {:02} min", total / 3600, total / 60 % 60);
}

void warn(const std::string& text) {
    static const std::shared_ptr<spdlog::logger> logger = [] {
        std::shared_ptr<spdlog::logger> made = spdlog::get("ewa");
        if (!made) {
            made = spdlog::stderr_color_mt("ewa");
            made->set_pattern("%^%l%$: %v");
        }
        return made;
    }();
    logger->warn("{}", one_line(text));
}

}  // namespace ewa::core
