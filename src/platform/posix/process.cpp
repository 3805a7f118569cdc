// SPDX-License-Identifier: Apache-2.0
#include "platform/process.h"

#include <fcntl.h>
#include <poll.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <string_view>

#include "platform/system.h"

extern char** environ;

namespace ewa::platform {
namespace {

constexpr int kShortTurn = 10;  // ms

std::vector<char*> pointers(std::vector<std::string>& texts) {
    std::vector<char*> result;
    for (std::string& text : texts) result.push_back(text.data());
    result.push_back(nullptr);
    return result;
}

/// This process's environment with the changes in front: the first of a name counts.
std::vector<std::string> environment_with(const std::vector<std::string>& changes) {
    std::vector<std::string> all = changes;
    for (char** entry = environ; *entry; ++entry) {
        const std::string_view text = *entry, name = text.substr(0, text.find('=') + 1);
        bool replaced = false;
        for (const std::string& own : changes) replaced = replaced || own.starts_with(name);
        if (!replaced) all.emplace_back(text);
    }
    return all;
}

bool give(std::intptr_t stream, int place, int mode) {
    if (stream == kOwn) return true;
    const int descriptor = stream < 0 ? open("/dev/null", mode) : int(stream);
    if (descriptor == place) return fcntl(place, F_SETFD, 0) == 0;
    return descriptor >= 0 && dup2(descriptor, place) >= 0;
}

/// What a program becomes.
struct Plan {
    char* const* command;
    char* const* environment;
    Streams streams;
    ProcessGroup group;
    Orphan orphan;
    pid_t parent;
};

/// Becomes the program, between fork and exec: nothing here takes memory or a lock. A reason why not goes to `report`.
[[noreturn]] void become(const Plan& plan, int report) {
    if (plan.group == ProcessGroup::own) setpgid(0, 0);
    // A killed parent cannot end the program. The program would run for hours, on files that the next run takes over.
    if (plan.orphan == Orphan::killed) prctl(PR_SET_PDEATHSIG, SIGKILL);
    if (getppid() != plan.parent) _exit(1);
    sigset_t none;
    sigemptyset(&none);
    sigprocmask(SIG_SETMASK, &none, nullptr);  // a program inherits what its parent blocks
    if (give(plan.streams.input, STDIN_FILENO, O_RDONLY) &&
        give(plan.streams.output, STDOUT_FILENO, O_WRONLY) &&
        give(plan.streams.errors, STDERR_FILENO, O_WRONLY))
        execve(plan.command[0], plan.command, plan.environment);
    const int reason = errno;
    _exit(write(report, &reason, sizeof(reason)) == sizeof(reason) ? 127 : 126);
}

std::error_code error_of(int number) {
    return {number, std::generic_category()};
}

}  // namespace

std::filesystem::path find_program(const std::string& name) {
    const char* path = std::getenv("PATH");
    std::string_view rest = path ? path : "";
    while (!rest.empty()) {
        const size_t colon = std::min(rest.find(':'), rest.size());
        const std::filesystem::path file = std::filesystem::path(rest.substr(0, colon)) / name;
        std::error_code ignored;
        if (colon > 0 && std::filesystem::is_regular_file(file, ignored) && access(file.c_str(), X_OK) == 0)
            return file;
        rest.remove_prefix(std::min(colon + 1, rest.size()));
    }
    return {};
}

std::vector<std::filesystem::path> find_pythons() {
    const std::filesystem::path environment = variable("VIRTUAL_ENV");
    return {environment.empty() ? environment : environment / "bin/python3", find_program("python3")};
}

int process_id() {
    return getpid();
}

bool is_running(int process) {
    return kill(process, 0) == 0 || errno != ESRCH;
}

struct Process::State {
    pid_t id;
    ProcessGroup group;
    pid_t all() const { return group == ProcessGroup::own ? -id : id; }
};

Process::Process() = default;
Process::~Process() = default;
Process::Process(Process&& other) noexcept = default;
Process& Process::operator=(Process&& other) noexcept = default;

std::error_code Process::start(std::vector<std::string> command, const std::vector<std::string>& environment,
                               const Streams& streams, ProcessGroup group, Orphan orphan) {
    std::vector<std::string> all = environment_with(environment);
    const std::vector<char*> words = pointers(command), changed = pointers(all);
    PipeFrom report;
    if (const std::error_code error = report.open()) return error;
    const Plan plan{words.data(), changed.data(), streams, group, orphan, getpid()};
    const pid_t child = fork();
    if (child == 0) become(plan, int(report.to.handle()));
    int reason = child < 0 ? errno : 0;
    report.to.close();
    // The end of the pipe closes as the program starts.
    if (child > 0 && read(int(report.from.handle()), &reason, sizeof(reason)) > 0) waitpid(child, nullptr, 0);
    if (reason != 0) return error_of(reason);
    state_ = std::make_unique<State>(State{child, group});
    return {};
}

bool Process::is_open() const {
    return state_ != nullptr;
}

int Process::id() const {
    return state_ ? state_->id : 0;
}

bool Process::has_ended() const {
    siginfo_t info{};
    return waitid(P_PID, id_t(state_->id), &info, WEXITED | WNOHANG | WNOWAIT) == 0 &&
           info.si_pid == state_->id;
}

ProcessEnd Process::wait() {
    int status = 0;
    while (waitpid(state_->id, &status, 0) < 0 && errno == EINTR) {
    }
    state_.reset();
    return WIFSIGNALED(status) ? ProcessEnd{0, WTERMSIG(status)} : ProcessEnd{WEXITSTATUS(status), 0};
}

void Process::ask_to_end() {
    ::kill(state_->all(), SIGTERM);
}

void Process::kill() {
    ::kill(state_->all(), SIGKILL);
}

void Process::end(std::chrono::milliseconds patience) {
    ask_to_end();
    for (int waited = 0; waited < patience.count() && !has_ended(); waited += kShortTurn)
        poll(nullptr, 0, kShortTurn);
    kill();  // the group has its number until wait()
    wait();
}

std::error_code PipeFrom::open() {
    int ends[2];
    if (pipe2(ends, O_CLOEXEC) != 0) return error_of(errno);
    from = File(ends[0]);
    to = File(ends[1]);
    return {};
}

// A socket, since writing to a pipe whose reader has ended would send a signal.
std::error_code PipeTo::open() {
    int ends[2];
    if (socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends) != 0) return error_of(errno);
    to = File(ends[0]);
    from = File(ends[1]);
    return {};
}

std::error_code PipeTo::write(const void* bytes, size_t size) {
    for (const char* next = static_cast<const char*>(bytes); size > 0;) {
        const ssize_t sent = send(int(to.handle()), next, size, MSG_NOSIGNAL);
        if (sent < 0 && errno == EINTR) continue;
        if (sent < 0) return error_of(errno);
        next += sent;
        size -= size_t(sent);
    }
    return {};
}

bool wait_for(const File& first, const File& second, std::chrono::milliseconds time, bool (&ready)[2]) {
    pollfd files[] = {{int(first.handle()), POLLIN, 0}, {int(second.handle()), POLLIN, 0}};
    int count = 0;
    do count = poll(files, 2, int(time.count()));
    while (count < 0 && errno == EINTR);
    for (int i = 0; i < 2; ++i) ready[i] = count > 0 && files[i].revents != 0;
    return count > 0;
}

}  // namespace ewa::platform
