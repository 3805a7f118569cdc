// SPDX-License-Identifier: Apache-2.0
#include "cli/interrupt.h"

#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <cstdio>
#include <string_view>

#include "core/atomic_file.h"
#include "core/process.h"

namespace ewa::cli {
namespace {

// SIGUSR1 is what mpirun passes on without ending the job, and what batch systems send before a time limit. SIGXCPU comes
// at the soft limit of ulimit -t.
constexpr std::array kSignals{SIGINT, SIGTERM, SIGHUP, SIGUSR1, SIGXCPU};
constexpr std::string_view kNote = "\nsaving, then ending; Ctrl-\\ ends at once without saving\n";

// Two threads can handle two signals at the same time.
std::atomic<bool> signalled = false, at_terminal = false;
static_assert(std::atomic<bool>::is_always_lock_free, "a signal handler may use only lock-free atomics");

std::atomic<pid_t> in_front = 0;  // the program that gets the signals; 0: none
static_assert(std::atomic<pid_t>::is_always_lock_free);

void pass_on(int signal) {
    const int reason = errno;
    if (const pid_t program = in_front) kill(program, signal);
    errno = reason;
}

/// Signals of a watch wait while one exists.
class SignalPause {
  public:
    SignalPause() {
        sigset_t waiting;
        sigemptyset(&waiting);
        for (const int signal : kSignals) sigaddset(&waiting, signal);
        pthread_sigmask(SIG_BLOCK, &waiting, &before_);
    }
    ~SignalPause() { pthread_sigmask(SIG_SETMASK, &before_, nullptr); }
    SignalPause(const SignalPause&) = delete;

  private:
    sigset_t before_;
};

void note_signal(int signal) {
    const int reason = errno;  // the interrupted code may still read it
    const bool first = !signalled.exchange(true);
    if (first && signal == SIGINT && at_terminal) (void)!write(STDERR_FILENO, kNote.data(), kNote.size());
    errno = reason;
}

void remove_files_and_end(int signal) {
    core::remove_unfinished_files();
    std::signal(signal, SIG_DFL);
    raise(signal);  // delivered when this handler returns: until then it is blocked
}

void remove_files_and_exit(int) {
    core::remove_unfinished_files();
    if (at_terminal) (void)!write(STDERR_FILENO, "\n", 1);
    _exit(kInterruptedStatus);
}

/// Installs a handler during which the other signals are blocked. Returns the previous one.
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

void remove_temporary_files_on_signals() {
    // A write beyond ulimit -f then fails, and says so.
    std::signal(SIGXFSZ, SIG_IGN);
    for (const int signal : kSignals) {
        const struct sigaction before = handle(signal, remove_files_and_end);
        if (before.sa_handler == SIG_IGN) sigaction(signal, &before, nullptr);
    }
}

int run_in_front(const std::vector<std::string>& command) {
    std::fflush(stdout);  // what it prints comes behind
    std::array<struct sigaction, kSignals.size()> before;
    {
        const SignalPause pause;
        in_front = core::start_program(command, {}, {.output = STDOUT_FILENO}, core::ProcessGroup::shared);
        for (size_t i = 0; i < kSignals.size(); ++i) {
            before[i] = handle(kSignals[i], pass_on);
            if (before[i].sa_handler == SIG_IGN) sigaction(kSignals[i], &before[i], nullptr);
        }
    }
    const pid_t program = in_front;
    siginfo_t ended{};
    while (waitid(P_PID, id_t(program), &ended, WEXITED | WNOWAIT) != 0 && errno == EINTR) {
    }
    in_front = 0;  // its number is its own until the next line
    int status = 0;
    waitpid(program, &status, 0);
    for (size_t i = 0; i < kSignals.size(); ++i) sigaction(kSignals[i], &before[i], nullptr);
    return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
}

void end_on_signals() {
    at_terminal = isatty(STDERR_FILENO) != 0;
    for (const int signal : kSignals) {
        const struct sigaction before = handle(signal, remove_files_and_exit);
        if (signal == SIGHUP && before.sa_handler == SIG_IGN) sigaction(signal, &before, nullptr);
    }
}

}  // namespace ewa::cli
