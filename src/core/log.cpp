// SPDX-License-Identifier: Apache-2.0
#include "core/log.h"

#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/spdlog.h>

#include <memory>

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
    logger->warn("{}", text);
}

}  // namespace ewa::core
