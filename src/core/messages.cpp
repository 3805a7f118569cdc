// SPDX-License-Identifier: Apache-2.0
#include "core/messages.h"

#include <spdlog/fmt/fmt.h>
#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/spdlog.h>

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
