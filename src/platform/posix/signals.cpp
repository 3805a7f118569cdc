// SPDX-License-Identifier: Apache-2.0
#include "platform/signals.h"

#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cerrno>
#include <csignal>

namespace ewa::platform {
namespace {

constexpr std::array kRequests{SIGINT, SIGTERM, SIGHUP, SIGUSR1, SIGXCPU};

std::atomic<pid_t> in_front = 0;  // the program that gets the requests; 0: none
static_assert(std::atomic<pid_t>::is_always_lock_free);

void pass_on(int request) {
    const int reason = errno;
    if (const pid_t program = in_front) kill(program, request);
    errno = reason;
}

sigset_t all_requests() {
    sigset_t all;
    sigemptyset(&all);
    for (const int request : kRequests) sigaddset(&all, request);
    return all;
}

/// Requests wait while one exists.
class RequestPause {
  public:
    RequestPause() {
        const sigset_t waiting = all_requests();
        pthread_sigmask(SIG_BLOCK, &waiting, &before_);
    }
    ~RequestPause() { pthread_sigmask(SIG_SETMASK, &before_, nullptr); }
    RequestPause(const RequestPause&) = delete;

  private:
    sigset_t before_;
};

}  // namespace

struct HandledRequests::State {
    std::array<struct sigaction, kRequests.size()> before;
};

HandledRequests::HandledRequests(RequestHandler handler, Ignored ignored)
    : state_(std::make_unique<State>()) {
    struct sigaction action {};
    action.sa_handler = handler;
    action.sa_flags = SA_RESTART;
    action.sa_mask = all_requests();
    for (size_t i = 0; i < kRequests.size(); ++i) {
        struct sigaction& before = state_->before[i];
        sigaction(kRequests[i], &action, &before);
        if (before.sa_handler == SIG_IGN && (ignored == Ignored::stay_ignored || kRequests[i] == SIGHUP))
            sigaction(kRequests[i], &before, nullptr);
    }
}

HandledRequests::~HandledRequests() {
    if (!state_) return;
    for (size_t i = 0; i < kRequests.size(); ++i) sigaction(kRequests[i], &state_->before[i], nullptr);
}

void HandledRequests::keep() {
    state_.reset();
}

bool is_interrupt(int request) {
    return request == SIGINT;
}

void end_by(int request) {
    std::signal(request, SIG_DFL);
    raise(request);  // delivered when the handler returns: until then it is blocked
}

void write_errors_now(std::string_view text) {
    (void)!write(STDERR_FILENO, text.data(), text.size());
}

void let_large_writes_fail() {
    std::signal(SIGXFSZ, SIG_IGN);
}

ProcessEnd run_in_front(const std::vector<std::string>& command, std::error_code& error) {
    Process program;
    std::unique_ptr<HandledRequests> passing;
    {
        const RequestPause pause;
        error = program.start(command, {}, {.output = kOwn}, ProcessGroup::shared);
        if (error) return {};
        in_front = program.id();
        passing = std::make_unique<HandledRequests>(pass_on, Ignored::stay_ignored);
    }
    siginfo_t ended{};
    while (waitid(P_PID, id_t(program.id()), &ended, WEXITED | WNOWAIT) != 0 && errno == EINTR) {
    }
    in_front = 0;  // its number is its own until the next line
    return program.wait();
}

}  // namespace ewa::platform
