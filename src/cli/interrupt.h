// SPDX-License-Identifier: Apache-2.0
// Ctrl-C and termination asked for politely: long work looks here between its steps.
#pragma once
#include <csignal>

#include <array>

namespace ewa::cli {

/// While it lives, SIGINT, SIGTERM and SIGHUP (unless nohup had it ignored) are only noted, however often
/// they come: timeout(1) signals the program and then its group, and a second Ctrl-C must not cost what the
/// first is about to save. What ends the program at once is SIGQUIT (Ctrl-\), as a terminal is told, and
/// SIGKILL. Afterwards signals do what they did before. One at a time.
class InterruptWatch {
  public:
    InterruptWatch();
    ~InterruptWatch();
    InterruptWatch(const InterruptWatch&) = delete;
    InterruptWatch& operator=(const InterruptWatch&) = delete;

  private:
    std::array<struct sigaction, 3> before_;
};

/// Whether a watch has noted a signal.
bool interrupted();

/// Thrown by stop_if_interrupted() out of work that has no other way to end early.
struct Interrupted {};
void stop_if_interrupted();
/// Whether the work was done to its end; not begun where it has been interrupted before.
template <class Work>
bool done_uninterrupted(Work&& work) {
    try {
        stop_if_interrupted();
        work();
        return true;
    } catch (const Interrupted&) {
        return false;
    }
}

/// For all the time that nobody watches: the same signals end the program as they do by themselves, but what
/// is being written beside its place goes first. Those that are ignored stay so.
void leave_nothing_when_ended();

/// What a program ended by Ctrl-C exits with.
inline constexpr int kInterruptedStatus = 130;

}  // namespace ewa::cli
