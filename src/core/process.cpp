// SPDX-License-Identifier: Apache-2.0
#include "core/process.h"

#include <fcntl.h>
#include <poll.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <cstring>

#include "core/folders.h"
#include "core/text.h"
#include "ewa/error.h"

extern char** environ;

namespace ewa::core {
namespace {

constexpr int kTurn = 100;       // ms
constexpr int kShortTurn = 10;   // ms
constexpr int kPatience = 3000;  // ms that a program has to end after SIGTERM

/// A file descriptor.
class Descriptor {
  public:
    explicit Descriptor(int value = -1) : value_(value) {}
    ~Descriptor() { close(); }
    Descriptor(const Descriptor&) = delete;
    int get() const { return value_; }
    void close() {
        if (value_ >= 0) ::close(value_);
        value_ = -1;
    }

  private:
    int value_;
};

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

void write_all(int descriptor, std::string_view text, const std::filesystem::path& path) {
    while (!text.empty()) {
        const ssize_t written = ::write(descriptor, text.data(), text.size());
        if (written < 0 && errno == EINTR) continue;
        if (written <= 0)
            throw RunError(one_line(path.string()) + ": cannot be written: " + std::strerror(errno));
        text.remove_prefix(size_t(written));
    }
}

/// Ends the child when an exception passes.
class Child {
  public:
    explicit Child(pid_t id) : id_(id) {}
    ~Child() {
        if (id_ > 0) end();
    }
    Child(const Child&) = delete;
    /// Ends the program and those that it has started. What ignores SIGTERM is killed.
    void end() {
        kill(-id_, SIGTERM);
        for (int waited = 0; waited < kPatience && !has_ended(); waited += kShortTurn)
            poll(nullptr, 0, kShortTurn);
        kill(-id_, SIGKILL);  // the group has its number until wait()
        wait();
    }
    bool has_ended() const {
        siginfo_t info{};
        return waitid(P_PID, id_t(id_), &info, WEXITED | WNOHANG | WNOWAIT) == 0 && info.si_pid == id_;
    }
    int wait() {
        int status = 0;
        while (waitpid(id_, &status, 0) < 0 && errno == EINTR) {
        }
        id_ = 0;
        return status;
    }

  private:
    pid_t id_;
};

bool give(int descriptor, int place, int mode) {
    if (descriptor < 0) descriptor = open("/dev/null", mode);
    if (descriptor == place) return fcntl(place, F_SETFD, 0) == 0;
    return descriptor >= 0 && dup2(descriptor, place) >= 0;
}

/// Becomes the program, between fork and exec: nothing here takes memory or a lock. A reason why not goes to `report`.
[[noreturn]] void become(char* const* command, char* const* environment, const Streams& streams, pid_t parent,
                         int report) {
    setpgid(0, 0);
    // A killed parent cannot end the program. The program would run for hours, on files that the next run takes over.
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    if (getppid() != parent) _exit(1);
    if (give(streams.input, STDIN_FILENO, O_RDONLY) && give(streams.output, STDOUT_FILENO, O_WRONLY) &&
        (streams.errors < 0 || give(streams.errors, STDERR_FILENO, O_WRONLY)))
        execve(command[0], command, environment);
    const int reason = errno;
    _exit(write(report, &reason, sizeof(reason)) == sizeof(reason) ? 127 : 126);
}

/// The program's file. A name without a slash is looked up in PATH.
std::string file_of(const std::string& program) {
    if (program.find('/') != std::string::npos) return program;
    const std::filesystem::path file = find_program(program);
    if (file.empty()) throw RunError("cannot start " + one_line(program) + ": " + std::strerror(ENOENT));
    return file.string();
}

}  // namespace

std::filesystem::path find_program(const std::string& name) {
    const char* path = std::getenv("PATH");
    std::string_view rest = path ? path : "";
    while (!rest.empty()) {
        const size_t colon = std::min(rest.find(':'), rest.size());
        const std::filesystem::path file = std::filesystem::path(rest.substr(0, colon)) / name;
        if (colon > 0 && is_file(file) && access(file.c_str(), X_OK) == 0) return file;
        rest.remove_prefix(std::min(colon + 1, rest.size()));
    }
    return {};
}

pid_t start_program(std::vector<std::string> command, const std::vector<std::string>& environment,
                    const Streams& streams) {
    const std::string name = one_line(command[0]);
    command[0] = file_of(command[0]);
    std::vector<std::string> all = environment_with(environment);
    const std::vector<char*> words = pointers(command), changed = pointers(all);
    int ends[2];
    if (pipe2(ends, O_CLOEXEC) != 0) throw RunError("cannot create a pipe");
    const Descriptor from(ends[0]);
    Descriptor to(ends[1]);
    const pid_t parent = getpid(), child = fork();
    if (child == 0) become(words.data(), changed.data(), streams, parent, to.get());
    int reason = child < 0 ? errno : 0;
    to.close();
    // The end of the pipe closes as the program starts.
    if (child > 0 && read(from.get(), &reason, sizeof(reason)) > 0) waitpid(child, nullptr, 0);
    if (reason != 0) throw RunError("cannot start " + name + ": " + std::strerror(reason));
    return child;
}

Ended run_program(const Program& program, const std::function<bool(std::string_view)>& output) {
    int ends[2];
    if (pipe2(ends, O_CLOEXEC) != 0) throw RunError("cannot create a pipe");
    const Descriptor from(ends[0]);
    Descriptor to(ends[1]);
    const Descriptor log(program.log.empty()
                             ? -1
                             : open(program.log.c_str(), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0666));
    if (!program.log.empty() && log.get() < 0)
        throw RunError(one_line(program.log.string()) + ": cannot be written: " + std::strerror(errno));
    Child child(start_program(program.command, program.environment,
                              {.input = -1, .output = to.get(), .errors = log.get()}));
    to.close();
    std::array<char, 65536> piece;
    // A program that has ended may have left its output to another one, which keeps it open.
    for (bool ended = false;;) {
        pollfd ready{from.get(), POLLIN, 0};
        const int count = poll(&ready, 1, ended ? 0 : kTurn);
        if (count == 0 && ended) break;
        ended = count == 0 && child.has_ended();
        if (count < 0 && errno != EINTR) throw RunError("cannot wait for " + one_line(program.command[0]));
        std::string_view text;
        if (count > 0) {
            const ssize_t n = read(from.get(), piece.data(), piece.size());
            if (n == 0) break;
            if (n > 0) text = {piece.data(), size_t(n)};
        }
        if (program.output_to_log) write_all(log.get(), text, program.log);
        if (!output(text)) {
            child.end();
            return Ended::stopped;
        }
    }
    return child.wait() == 0 ? Ended::done : Ended::failed;
}

}  // namespace ewa::core
