// SPDX-License-Identifier: Apache-2.0
// Requests to end this process. POSIX: SIGINT, SIGTERM, SIGHUP, SIGUSR1, which mpirun passes on and batch systems send before a
// time limit, and SIGXCPU, which comes at the soft limit of ulimit -t. Windows: Ctrl-C and Ctrl-Break on the console, its closing,
// the user's logging off, the system's shutdown, and Process::ask_to_end() of another process.
#pragma once
#include <memory>
#include <string>
#include <string_view>
#include <system_error>
#include <vector>

#include "platform/process.h"

namespace ewa::platform {

/// Gets the number of a request. POSIX: runs as a signal handler, during which other requests wait. Windows: runs on a thread of
/// its own; after a request that cannot be refused, such as a closed console, the process has five seconds.
using RequestHandler = void (*)(int request);

/// Requests that this process was started to ignore.
enum class Ignored { stay_ignored, hang_up_stays_ignored };

/// Installs a handler. The destructor restores the one before.
class HandledRequests {
  public:
    HandledRequests(RequestHandler handler, Ignored ignored);
    ~HandledRequests();
    HandledRequests(const HandledRequests&) = delete;
    HandledRequests& operator=(const HandledRequests&) = delete;
    /// The destructor restores nothing.
    void keep();

  private:
    struct State;
    std::unique_ptr<State> state_;
};

/// Whether the request is Ctrl-C.
bool is_interrupt(int request);

/// For handlers: ends the process as the request does without a handler, when the handler returns.
void end_by(int request);

/// For handlers: writes to standard error.
void write_errors_now(std::string_view text);

/// Makes a write beyond the limit of a file's size an error, as on a full disk. Windows has no such limit.
void let_large_writes_fail();

/// Runs a program with this process's standard output and error, and an empty standard input. Requests to end go to the program.
/// command: the path of the program, then its arguments. error: why it cannot be started.
ProcessEnd run_in_front(const std::vector<std::string>& command, std::error_code& error);

}  // namespace ewa::platform
