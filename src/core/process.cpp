// SPDX-License-Identifier: Apache-2.0
#include "core/process.h"

#include <fcntl.h>
#include <poll.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <optional>
#include <system_error>

#include "core/folders.h"
#include "core/text.h"
#include "ewa/error.h"
#include "platform/library.h"

extern char** environ;

namespace ewa::core {
namespace {

constexpr int kTurn = 100;                       // ms
constexpr int kShortTurn = 10;                   // ms
constexpr int kPatience = 3000;                  // ms that a program has to end after SIGTERM
constexpr size_t kMostAnswer = size_t(1) << 20;  // bytes
constexpr auto kAnswerTime = std::chrono::seconds(30);

/// A file descriptor.
class Descriptor {
  public:
    explicit Descriptor(int value = -1) : value_(value) {}
    ~Descriptor() { close(); }
    Descriptor(const Descriptor&) = delete;
    int get() const { return value_; }
    void set(int value) {
        close();
        value_ = value;
    }
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

/// A pipe from a program.
struct Pipe {
    Pipe() {
        int ends[2];
        if (pipe2(ends, O_CLOEXEC) != 0) throw RunError("cannot create a pipe");
        from.set(ends[0]);
        to.set(ends[1]);
    }
    /// What has arrived. Closes `from` at the end.
    std::string_view read(std::array<char, 65536>& buffer) {
        const ssize_t n = ::read(from.get(), buffer.data(), buffer.size());
        if (n == 0) from.close();
        return {buffer.data(), n > 0 ? size_t(n) : 0};
    }

    Descriptor from, to;
};

/// The file that a program's messages are appended to. Without a path, nothing is written.
class Log {
  public:
    explicit Log(const std::filesystem::path& path) : path_(path) {
        if (path.empty()) return;
        file_.set(open(path.c_str(), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0666));
        if (file_.get() < 0) fail();
    }
    void add(std::string_view text) {
        if (text.size() >= left_ && left_ > 0) {
            write(text.substr(0, left_));
            write("\n[the rest is left out]\n");
        } else if (left_ > 0) {
            write(text);
        }
        left_ -= std::min(left_, text.size());
    }

  private:
    void write(std::string_view text) {
        while (!text.empty()) {
            const ssize_t written = ::write(file_.get(), text.data(), text.size());
            if (written < 0 && errno == EINTR) continue;
            if (written <= 0) fail();
            text.remove_prefix(size_t(written));
        }
    }
    [[noreturn]] void fail() const {
        throw RunError(one_line(path_.string()) + ": cannot be written: " + std::strerror(errno));
    }

    std::filesystem::path path_;
    Descriptor file_;
    size_t left_ = kMostLog;
};

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
[[noreturn]] void become(char* const* command, char* const* environment, const Streams& streams,
                         ProcessGroup group, pid_t parent, int report) {
    if (group == ProcessGroup::own) setpgid(0, 0);
    // A killed parent cannot end the program. The program would run for hours, on files that the next run takes over.
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    if (getppid() != parent) _exit(1);
    sigset_t none;
    sigemptyset(&none);
    sigprocmask(SIG_SETMASK, &none, nullptr);  // a program inherits what its parent blocks
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

std::filesystem::path own_program() {
    std::error_code unknown;
    std::filesystem::path program = platform::own_program(unknown);
    if (unknown) throw RunError("cannot find where this program is: " + unknown.message());
    return program;
}

pid_t start_program(std::vector<std::string> command, const std::vector<std::string>& environment,
                    const Streams& streams, ProcessGroup group) {
    const std::string name = one_line(command[0]);
    command[0] = file_of(command[0]);
    std::vector<std::string> all = environment_with(environment);
    const std::vector<char*> words = pointers(command), changed = pointers(all);
    Pipe report;
    const pid_t parent = getpid(), child = fork();
    if (child == 0) become(words.data(), changed.data(), streams, group, parent, report.to.get());
    int reason = child < 0 ? errno : 0;
    report.to.close();
    // The end of the pipe closes as the program starts.
    if (child > 0 && read(report.from.get(), &reason, sizeof(reason)) > 0) waitpid(child, nullptr, 0);
    if (reason != 0) throw RunError("cannot start " + name + ": " + std::strerror(reason));
    return child;
}

Ended run_program(const Program& program, const std::function<bool(std::string_view)>& output) {
    Log log(program.log);
    Pipe out;
    std::optional<Pipe> errors;
    if (!program.log.empty() && !program.joined) errors.emplace();
    const int to_log = errors ? errors->to.get() : program.joined ? out.to.get() : -1;
    Child child(start_program(program.command, program.environment,
                              {.input = -1, .output = out.to.get(), .errors = to_log}));
    out.to.close();
    if (errors) errors->to.close();
    std::array<char, 65536> buffer;
    // A program that has ended may have left its output to another one, which keeps it open. Others close theirs and continue.
    for (bool ended = false;;) {
        pollfd ready[] = {{out.from.get(), POLLIN, 0}, {errors ? errors->from.get() : -1, POLLIN, 0}};
        const bool open = ready[0].fd >= 0 || ready[1].fd >= 0;
        const int count = poll(ready, 2, ended ? 0 : open ? kTurn : kShortTurn);
        if (count == 0 && ended) break;
        ended = count == 0 && child.has_ended();
        if (count < 0 && errno != EINTR) throw RunError("cannot wait for " + one_line(program.command[0]));
        std::string_view text;
        if (count > 0 && ready[1].revents != 0) log.add(errors->read(buffer));
        if (count > 0 && ready[0].revents != 0) text = out.read(buffer);
        if (program.output_to_log) log.add(text);
        if (!output(text)) {
            child.end();
            return Ended::stopped;
        }
    }
    return child.wait() == 0 ? Ended::done : Ended::failed;
}

Answer ask_program(const Program& program, const std::function<bool()>& go_on) {
    const auto until = std::chrono::steady_clock::now() + kAnswerTime;
    Answer answer;
    bool wanted = true;
    answer.ended = run_program(program, [&](std::string_view piece) {
        answer.text.append(piece, 0, kMostAnswer - answer.text.size());
        wanted = go_on();
        return wanted && answer.text.size() < kMostAnswer && std::chrono::steady_clock::now() < until;
    });
    answer.cut = wanted && answer.ended == Ended::stopped;
    if (answer.cut) answer.ended = Ended::failed;
    return answer;
}

}  // namespace ewa::core
