// SPDX-License-Identifier: Apache-2.0
#include "cli/interrupt.h"

#include <atomic>
#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <string_view>

#include "core/atomic_file.h"
#include "core/text.h"
#include "ewa/error.h"
#include "platform/terminal.h"

namespace ewa::cli {
namespace {

constexpr std::string_view kNote = "\nsaving, then ending; Ctrl-\\ ends at once without saving\n";

// Two threads can handle two signals at the same time.
std::atomic<bool> signalled = false, at_terminal = false;
static_assert(std::atomic<bool>::is_always_lock_free, "a signal handler may use only lock-free atomics");

void note_request(int request) {
    const int reason = errno;  // the interrupted code may still read it
    const bool first = !signalled.exchange(true);
    if (first && platform::is_interrupt(request) && at_terminal) platform::write_errors_now(kNote);
    errno = reason;
}

void remove_files_and_end(int request) {
    core::remove_unfinished_files();
    platform::end_by(request);
}

void remove_files_and_exit(int) {
    core::remove_unfinished_files();
    if (at_terminal) platform::write_errors_now("\n");
    std::_Exit(kInterruptedStatus);
}

/// The handler, after it is known whether a terminal shows what it writes.
platform::RequestHandler with_terminal(platform::RequestHandler handler) {
    at_terminal = platform::is_terminal(platform::Stream::errors);
    return handler;
}

}  // namespace

InterruptWatch::InterruptWatch()
    : handled_(with_terminal(note_request), platform::Ignored::hang_up_stays_ignored) {}

bool interrupted() {
    return signalled;
}

void remove_temporary_files_on_signals() {
    platform::let_large_writes_fail();
    platform::HandledRequests(remove_files_and_end, platform::Ignored::stay_ignored).keep();
}

int run_in_front(const std::vector<std::string>& command) {
    std::fflush(stdout);  // what it prints comes behind
    std::error_code error;
    const platform::ProcessEnd ended = platform::run_in_front(command, error);
    if (error) throw RunError("cannot start " + core::one_line(command[0]) + ": " + error.message());
    return ended.code();
}

void end_on_signals() {
    platform::HandledRequests(with_terminal(remove_files_and_exit), platform::Ignored::hang_up_stays_ignored)
        .keep();
}

}  // namespace ewa::cli
