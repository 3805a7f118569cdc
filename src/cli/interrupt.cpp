// SPDX-License-Identifier: Apache-2.0
#include "cli/interrupt.h"

#include <unistd.h>

#include <string_view>

#include "core/atomic_file.h"

namespace ewa::cli {
namespace {

constexpr std::array kSignals{SIGINT, SIGTERM, SIGHUP};
constexpr std::string_view kNote =
    "\nending as soon as what is done is saved; Ctrl-\\ ends at once, without saving\n";

volatile std::sig_atomic_t signalled = 0, at_terminal = 0;

void note_signal(int signal) {
    if (signal == SIGINT && at_terminal && !signalled)
        (void)!write(STDERR_FILENO, kNote.data(), kNote.size());
    signalled = 1;
}

void end_without_traces(int signal) {
    core::remove_unfinished_files();
    raise(signal);  // which does by now what it does by itself
}

/// `handler` for the signal, and what was there before.
struct sigaction handle(int signal, void (*handler)(int), int flags) {
    struct sigaction action {
    }, before{};
    action.sa_handler = handler;
    action.sa_flags = flags;
    sigemptyset(&action.sa_mask);
    sigaction(signal, &action, &before);
    return before;
}

}  // namespace

InterruptWatch::InterruptWatch() {
    at_terminal = isatty(STDERR_FILENO);
    for (size_t i = 0; i < kSignals.size(); ++i) {
        before_[i] = handle(kSignals[i], note_signal, SA_RESTART);
        if (kSignals[i] == SIGHUP && before_[i].sa_handler == SIG_IGN)
            sigaction(SIGHUP, &before_[i], nullptr);
    }
}

InterruptWatch::~InterruptWatch() {
    for (size_t i = 0; i < kSignals.size(); ++i) sigaction(kSignals[i], &before_[i], nullptr);
}

bool interrupted() {
    return signalled != 0;
}

void stop_if_interrupted() {
    if (interrupted()) throw Interrupted();
}

void leave_nothing_when_ended() {
    for (const int signal : kSignals) {
        const struct sigaction before = handle(signal, end_without_traces, SA_RESETHAND | SA_NODEFER);
        if (before.sa_handler == SIG_IGN) sigaction(signal, &before, nullptr);
    }
}

}  // namespace ewa::cli
