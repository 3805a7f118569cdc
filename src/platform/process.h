// SPDX-License-Identifier: Apache-2.0
// Programs that this process starts, without a shell, and the pipes to them.
#pragma once
#include <chrono>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <system_error>
#include <vector>

#include "platform/file.h"

namespace ewa::platform {

/// The executable file of this name in PATH; empty if there is none. Entries of PATH that are empty count for nothing.
/// Windows: `name` may lack its ".exe".
std::filesystem::path find_program(const std::string& name);

/// Where Python's interpreter is: that of the active virtual environment, then those in PATH. Some may not exist.
std::vector<std::filesystem::path> find_pythons();

/// The number of this process.
int process_id();
/// Whether a process of this number exists on this machine.
bool is_running(int process);

constexpr std::intptr_t kNothing = -1;  // an empty input; an output that is thrown away
constexpr std::intptr_t kOwn = -2;      // this process's

/// The standard streams of a program: kNothing, kOwn, or File::handle().
struct Streams {
    std::intptr_t input = kNothing;
    std::intptr_t output = kNothing;
    std::intptr_t errors = kOwn;
};

/// Whether Ctrl-C on a terminal reaches only this process (own), or the started program as well (shared).
enum class ProcessGroup { own, shared };

/// What happens to the program when the one that started it is killed.
enum class Orphan { killed, continues };

struct ProcessEnd {
    int status = 0;  // the exit status
    int signal = 0;  // the number of the signal that ended it, or 0. Windows: 0
    int code() const { return signal ? 128 + signal : status; }
};

/// A program that was started.
class Process {
  public:
    Process();
    ~Process();  // neither ends the program nor waits for it
    Process(Process&& other) noexcept;
    Process& operator=(Process&& other) noexcept;

    /// command: the path of the program, then its arguments. environment: NAME=value, beside those of this process.
    std::error_code start(std::vector<std::string> command, const std::vector<std::string>& environment,
                          const Streams& streams, ProcessGroup group = ProcessGroup::own,
                          Orphan orphan = Orphan::killed);
    /// Whether it was started, and wait() has not returned.
    bool is_open() const;
    int id() const;

    bool has_ended() const;
    ProcessEnd wait();
    /// Asks the program, and those in its own group, to end as Ctrl-C does. Windows: one that shares no console and does not take
    /// such requests (signals.h) is killed.
    void ask_to_end();
    void kill();
    /// Ends the program, and those that it has started: asks, after `patience` kills, then waits.
    void end(std::chrono::milliseconds patience);

  private:
    struct State;
    std::unique_ptr<State> state_;
};

/// A pipe from a program: its output is `to`, and this process reads `from`.
struct PipeFrom {
    File from, to;
    std::error_code open();
};

/// A pipe to a program: its input is `from`, and this process writes to it.
struct PipeTo {
    File from, to;
    std::error_code open();
    /// Writes all. A program that has ended is an error, and no signal.
    std::error_code write(const void* bytes, size_t size);
};

/// Waits until one of the two pipes has something to read, or has ended. ready: which. Those that are not open count for nothing.
/// Returns false after the time.
bool wait_for(const File& first, const File& second, std::chrono::milliseconds time, bool (&ready)[2]);

}  // namespace ewa::platform
