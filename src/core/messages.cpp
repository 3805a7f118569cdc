// SPDX-License-Identifier: Apache-2.0
#include "core/messages.h"

#include <spdlog/fmt/fmt.h>
#include <spdlog/pattern_formatter.h>
#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/spdlog.h>

#include <memory>
#include <mutex>
#include <utility>

#include "core/text.h"
#include "ewa/log.h"

namespace ewa {
namespace {

struct Log {
    std::recursive_mutex mutex;
    std::shared_ptr<const LogHandler> handler;  // shared with a call of it, in which it may be replaced
};

/// Never destroyed: other objects may warn while they are.
Log& log_of_process() {
    static Log& log = *new Log;
    return log;
}

}  // namespace

void set_log_handler(LogHandler handler) {
    Log& log = log_of_process();
    auto next = handler ? std::make_shared<const LogHandler>(std::move(handler)) : nullptr;
    const std::lock_guard lock(log.mutex);
    log.handler.swap(next);
}

namespace core {

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
    Log& log = log_of_process();
    const std::lock_guard lock(log.mutex);
    if (const auto handler = log.handler) (*handler)(LogLevel::warning, one_line(text));
}

void print_warnings() {
    set_log_handler([](LogLevel, std::string_view text) {
        static const std::shared_ptr<spdlog::logger> logger = [] {
            auto made = spdlog::stderr_color_mt("ewa");
            // Windows' end of a line would be "\r\n".
            made->set_formatter(std::make_unique<spdlog::pattern_formatter>(
                "%^%l%$: %v", spdlog::pattern_time_type::local, "\n"));
            return made;
        }();
        logger->warn("{}", text);
    });
}

}  // namespace core
}  // namespace ewa
