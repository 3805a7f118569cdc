// SPDX-License-Identifier: Apache-2.0
// The messages of functions that cannot return them. libewa prints nothing itself: a handler of the program gets them.
#pragma once
#include <functional>
#include <string_view>

namespace ewa {

/// The importance of a message.
enum class LogLevel { warning };

/// text: one line without an end of line, valid during the call.
using LogHandler = std::function<void(LogLevel level, std::string_view text)>;

/// Sets the handler of the whole process. Null, as at the start: messages are dropped. Calls of the handler come from the
/// threads that call libewa, one at a time. The earlier handler is not called after this function returns. The handler may
/// call libewa. It must not throw.
void set_log_handler(LogHandler handler);

}  // namespace ewa
