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
}

bool interrupted() {
    return signalled != 0;
}

}  // namespace ewa::cli
