// SPDX-License-Identifier: Apache-2.0
#include "core/process.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <optional>
#include <system_error>

#include "core/text.h"
#include "ewa/error.h"
#include "platform/library.h"

namespace ewa::core {
namespace {

constexpr std::chrono::milliseconds kTurn(100), kShortTurn(10);
constexpr std::chrono::seconds kPatience(3);     // that a program has to end after it was asked to
constexpr size_t kMostAnswer = size_t(1) << 20;  // bytes
constexpr auto kAnswerTime = std::chrono::seconds(30);

using Buffer = std::array<char, 65536>;

/// What has arrived. Closes `file` at the end.
std::string_view arrived(platform::File& file, Buffer& buffer) {
    size_t count = 0;
    if (!file.read(buffer.data(), buffer.size(), count) && count == 0) file.close();
    return {buffer.data(), count};
}

platform::PipeFrom open_pipe() {
    platform::PipeFrom pipe;
    if (pipe.open()) throw RunError("cannot create a pipe");
    return pipe;
}

/// The file that a program's messages are appended to. Without a path, nothing is written.
class Log {
  public:
    explicit Log(const std::filesystem::path& path) : path_(path) {
        if (path.empty()) return;
        if (const auto error = file_.open(path, platform::Open::append)) fail(error);
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
        if (const auto error = file_.write(text.data(), text.size())) fail(error);
    }
    [[noreturn]] void fail(const std::error_code& error) const {
        throw RunError(one_line(path_.string()) + ": cannot be written: " + error.message());
    }

    std::filesystem::path path_;
    platform::File file_;
    size_t left_ = kMostLog;
};

/// Ends the program when an exception passes.
struct Ending {
    platform::Process& program;
    ~Ending() {
        if (program.is_open()) program.end(kPatience);
    }
};

/// The program's file. A name without a folder is looked up in PATH.
std::string file_of(const std::string& program) {
    if (std::filesystem::path(program).has_parent_path()) return program;
    const std::filesystem::path file = find_program(program);
    if (file.empty())
        throw RunError("cannot start " + one_line(program) + ": " +
                       std::make_error_code(std::errc::no_such_file_or_directory).message());
    return file.string();
}

}  // namespace

std::filesystem::path own_program() {
    std::error_code unknown;
    std::filesystem::path program = platform::own_program(unknown);
    if (unknown) throw RunError("cannot find where this program is: " + unknown.message());
    return program;
}

platform::Process start_program(std::vector<std::string> command, const std::vector<std::string>& environment,
                                const platform::Streams& streams, platform::Orphan orphan) {
    const std::string name = one_line(command[0]);
    command[0] = file_of(command[0]);
    platform::Process program;
    if (const auto error =
            program.start(std::move(command), environment, streams, platform::ProcessGroup::own, orphan))
        throw RunError("cannot start " + name + ": " + error.message());
    return program;
}

Ended run_program(const Program& program, const std::function<bool(std::string_view)>& output) {
    Log log(program.log);
    platform::PipeFrom out = open_pipe(), errors;
    const bool logged = !program.log.empty() && !program.joined;
    if (logged) errors = open_pipe();
    const std::intptr_t to_log = logged           ? errors.to.handle()
                                 : program.joined ? out.to.handle()
                                                  : platform::kOwn;
    platform::Process child =
        start_program(program.command, program.environment, {.output = out.to.handle(), .errors = to_log});
    const Ending ending{child};
    out.to.close();
    errors.to.close();
    Buffer buffer;
    // A program that has ended may have left its output to another one, which keeps it open. Others close theirs and continue.
    for (bool ended = false;;) {
        const bool open = out.from.is_open() || errors.from.is_open();
        bool ready[2];
        const auto time = ended ? std::chrono::milliseconds(0) : open ? kTurn : kShortTurn;
        const bool any = platform::wait_for(out.from, errors.from, time, ready);
        if (!any && ended) break;
        ended = !any && child.has_ended();
        std::string_view text;
        if (ready[1]) log.add(arrived(errors.from, buffer));
        if (ready[0]) text = arrived(out.from, buffer);
        if (program.output_to_log) log.add(text);
        if (!output(text)) {
            child.end(kPatience);
            return Ended::stopped;
        }
    }
    return child.wait().code() == 0 ? Ended::done : Ended::failed;
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
