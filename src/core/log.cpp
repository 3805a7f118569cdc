// SPDX-License-Identifier: Apache-2.0
#include "core/log.h"

#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/spdlog.h>

#include <memory>

#include "core/text.h"

namespace ewa::core {

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
