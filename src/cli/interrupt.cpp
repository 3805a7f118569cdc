// SPDX-License-Identifier: Apache-2.0
#include "cli/interrupt.h"

#include <csignal>

namespace ewa::cli {
namespace {

volatile std::sig_atomic_t signalled = 0;

void note_signal(int) {
    signalled = 1;
}

}  // namespace

void watch_for_interrupt() {
    struct sigaction action {};
    action.sa_handler = note_signal;
    action.sa_flags = SA_RESETHAND | SA_RESTART;
    sigemptyset(&action.sa_mask);
    sigaction(SIGINT, &action, nullptr);
    sigaction(SIGTERM, &action, nullptr);
    // A closed terminal; nohup has it ignored, and so it stays.
    struct sigaction before {};
    sigaction(SIGHUP, nullptr, &before);
    if (before.sa_handler != SIG_IGN) sigaction(SIGHUP, &action, nullptr);
}

bool interrupted() {
    return signalled != 0;
}

}  // namespace ewa::cli
