// SPDX-License-Identifier: Apache-2.0
#include "cli/interrupt.h"

#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <string_view>

#include "core/atomic_file.h"

namespace ewa::cli {
namespace {

constexpr std::array kSignals{SIGINT, SIGTERM, SIGHUP};
constexpr std::string_view kNote =
    "\nending as soon as what is done is saved; Ctrl-\\ ends at once, without saving\n";

// Two signals can be handled at once, by two threads.
std::atomic<bool> signalled = false, at_terminal = false;
static_assert(std::atomic<bool>::is_always_lock_free, "or a handler may not use it");

void note_signal(int signal) {
    const int reason = errno;  // of what this comes in between of
    const bool first = !signalled.exchange(true);
    if (first && signal == SIGINT && at_terminal) (void)!write(STDERR_FILENO, kNote.data(), kNote.size());
    errno = reason;
}

void end_without_traces(int signal) {
    core::remove_unfinished_files();
    std::signal(signal, SIG_DFL);
    raise(signal);  // taken at the handler's end, until which it is blocked
}

/// `handler` for the signal, in which none of the others arrives, and what was there before.
struct sigaction handle(int signal, void (*handler)(int)) {
    struct sigaction action {
    }, before{};
    action.sa_handler = handler;
    action.sa_flags = SA_RESTART;
    sigemptyset(&action.sa_mask);
    for (const int other : kSignals) sigaddset(&action.sa_mask, other);
    sigaction(signal, &action, &before);
    return before;
}

}  // namespace

InterruptWatch::InterruptWatch() {
    at_terminal = isatty(STDERR_FILENO) != 0;
    for (size_t i = 0; i < kSignals.size(); ++i) {
        before_[i] = handle(kSignals[i], note_signal);
        if (kSignals[i] == SIGHUP && before_[i].sa_handler == SIG_IGN)
            sigaction(SIGHUP, &before_[i], nullptr);
    }
}

InterruptWatch::~InterruptWatch() {
    for (size_t i = 0; i < kSignals.size(); ++i) sigaction(kSignals[i], &before_[i], nullptr);
}

bool interrupted() {
    return signalled;
}

void stop_if_interrupted() {
    if (interrupted()) throw Interrupted();
}

void leave_nothing_when_ended() {
    for (const int signal : kSignals) {
        const struct sigaction before = handle(signal, end_without_traces);
        if (before.sa_handler == SIG_IGN) sigaction(signal, &before, nullptr);
    }
}

}  // namespace ewa::cli
