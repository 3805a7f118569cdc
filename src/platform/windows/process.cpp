// SPDX-License-Identifier: Apache-2.0
#include "platform/process.h"

#include <algorithm>
#include <cwctype>

#include "platform/system.h"
#include "platform/windows/requests.h"
#include "platform/windows/windows.h"

namespace ewa::platform {
namespace {

namespace fs = std::filesystem;

constexpr DWORD kPipeBytes = 1u << 20;
constexpr DWORD kShortTurn = 5;  // ms

/// A word as the C library of the program splits the command line.
std::wstring quoted(const std::wstring& word) {
    if (!word.empty() && word.find_first_of(L" \t\n\v\"") == std::wstring::npos) return word;
    std::wstring text = L"\"";
    size_t backslashes = 0;
    for (const wchar_t c : word) {
        if (c == L'"') text.append(backslashes + 1, L'\\');  // doubles those before it, and escapes it
        backslashes = c == L'\\' ? backslashes + 1 : 0;
        text += c;
    }
    return text.append(backslashes, L'\\') + L'"';
}

std::wstring line_of(const std::vector<std::string>& command) {
    std::wstring line;
    for (const std::string& word : command) line += (line.empty() ? L"" : L" ") + quoted(wide(word));
    return line;
}

/// Whether both are NAME=, however the letters are written.
bool same_name(std::wstring_view a, std::wstring_view b) {
    return std::ranges::equal(a, b,
                              [](wchar_t x, wchar_t y) { return std::towupper(x) == std::towupper(y); });
}

/// This process's environment with the changes, as CreateProcessW takes it: each ends with a zero, and all with one more.
std::wstring environment_with(const std::vector<std::string>& changes) {
    std::wstring all;
    for (const std::string& change : changes) all.append(wide(change)).push_back(0);
    wchar_t* own = GetEnvironmentStringsW();
    for (const wchar_t* entry = own; own && *entry;) {
        const std::wstring_view text = entry;
        // Names such as =C: begin with the sign.
        const std::wstring_view name = text.substr(0, text.find(L'=', 1) + 1);
        const bool replaced = std::ranges::any_of(changes, [&](const std::string& change) {
            return same_name(wide(change.substr(0, change.find('=') + 1)), name);
        });
        if (!replaced) all.append(text).push_back(0);
        entry += text.size() + 1;
    }
    if (own) FreeEnvironmentStringsW(own);
    all.push_back(0);
    return all;
}

/// A handle that the started program inherits.
class Inherited {
  public:
    /// own: the number of this process's standard stream.
    Inherited(std::intptr_t stream, DWORD own, DWORD access) {
        if (stream == kNothing) {
            SECURITY_ATTRIBUTES inherit{sizeof(inherit), nullptr, TRUE};
            handle_ = CreateFileW(L"NUL", access, FILE_SHARE_READ | FILE_SHARE_WRITE, &inherit, OPEN_EXISTING,
                                  0, nullptr);
            return;
        }
        const HANDLE given = stream == kOwn ? GetStdHandle(own) : handle_of(stream);
        if (!given || given == INVALID_HANDLE_VALUE ||
            !DuplicateHandle(GetCurrentProcess(), given, GetCurrentProcess(), &handle_, 0, TRUE,
                             DUPLICATE_SAME_ACCESS))
            handle_ = nullptr;
    }
    ~Inherited() {
        if (handle_ && handle_ != INVALID_HANDLE_VALUE) CloseHandle(handle_);
    }
    Inherited(const Inherited&) = delete;
    Inherited& operator=(const Inherited&) = delete;
    HANDLE get() const { return handle_; }

  private:
    HANDLE handle_ = nullptr;
};

/// Names the handles that the program inherits, so that it gets no others of this process.
class StartInfo {
  public:
    StartInfo(HANDLE input, HANDLE output, HANDLE errors) {
        info_.StartupInfo.cb = sizeof(info_);
        info_.StartupInfo.dwFlags = STARTF_USESTDHANDLES;
        info_.StartupInfo.hStdInput = input;
        info_.StartupInfo.hStdOutput = output;
        info_.StartupInfo.hStdError = errors;
        for (const HANDLE handle : {input, output, errors})
            if (handle) handles_.push_back(handle);
        SIZE_T bytes = 0;
        InitializeProcThreadAttributeList(nullptr, 1, 0, &bytes);
        list_.resize(bytes);
        info_.lpAttributeList = reinterpret_cast<LPPROC_THREAD_ATTRIBUTE_LIST>(list_.data());
        InitializeProcThreadAttributeList(info_.lpAttributeList, 1, 0, &bytes);
        if (!handles_.empty())
            UpdateProcThreadAttribute(info_.lpAttributeList, 0, PROC_THREAD_ATTRIBUTE_HANDLE_LIST,
                                      handles_.data(), handles_.size() * sizeof(HANDLE), nullptr, nullptr);
    }
    ~StartInfo() { DeleteProcThreadAttributeList(info_.lpAttributeList); }
    StartInfo(const StartInfo&) = delete;
    STARTUPINFOW* get() { return &info_.StartupInfo; }

  private:
    STARTUPINFOEXW info_{};
    std::vector<HANDLE> handles_;
    std::vector<char> list_;
};

/// A group of processes, which can be ended together. killed: those that it has end with this process.
HANDLE make_job(bool killed) {
    HANDLE job = CreateJobObjectW(nullptr, nullptr);
    JOBOBJECT_EXTENDED_LIMIT_INFORMATION limits{};
    limits.BasicLimitInformation.LimitFlags = killed ? JOB_OBJECT_LIMIT_KILL_ON_JOB_CLOSE : 0;
    if (job) SetInformationJobObject(job, JobObjectExtendedLimitInformation, &limits, sizeof(limits));
    return job;
}

/// The program's file. Windows adds no ".exe" to a path.
fs::path with_extension(const fs::path& program) {
    std::error_code ignored;
    if (fs::exists(program, ignored)) return program;
    return fs::path(program.native() + L".exe");
}

size_t bytes_in(const File& pipe, bool& ended) {
    DWORD count = 0;
    ended = !PeekNamedPipe(handle_of(pipe.handle()), nullptr, 0, nullptr, &count, nullptr);
    return count;
}

std::error_code open_pipe(File& from, File& to) {
    HANDLE reads = nullptr, writes = nullptr;
    if (!CreatePipe(&reads, &writes, nullptr, kPipeBytes)) return last_error();
    from = File(value_of(reads));
    to = File(value_of(writes));
    return {};
}

}  // namespace

fs::path find_program(const std::string& name) {
    const std::string path = variable("PATH");
    std::string_view rest = path;
    while (!rest.empty()) {
        const size_t end = std::min(rest.find(';'), rest.size());
        std::string_view folder = rest.substr(0, end);
        if (folder.size() >= 2 && folder.front() == '"' && folder.back() == '"')
            folder = folder.substr(1, folder.size() - 2);
        for (const char* extension : {"", ".exe"}) {
            const fs::path file = fs::path(folder) / (name + extension);
            std::error_code ignored;
            if (!folder.empty() && file.has_extension() && fs::is_regular_file(file, ignored)) return file;
        }
        rest.remove_prefix(std::min(end + 1, rest.size()));
    }
    return {};
}

std::vector<fs::path> find_pythons() {
    const fs::path environment = variable("VIRTUAL_ENV");
    return {environment.empty() ? environment : environment / "Scripts" / "python.exe",
            find_program("python"), find_program("py")};
}

int process_id() {
    return int(GetCurrentProcessId());
}

bool is_running(int process) {
    const HANDLE handle = OpenProcess(SYNCHRONIZE, FALSE, DWORD(process));
    if (!handle) return GetLastError() != ERROR_INVALID_PARAMETER;
    const bool runs = WaitForSingleObject(handle, 0) == WAIT_TIMEOUT;
    CloseHandle(handle);
    return runs;
}

struct Process::State {
    HANDLE process = nullptr, job = nullptr;
    DWORD id = 0;
    ~State() {
        if (process) CloseHandle(process);
        if (job) CloseHandle(job);
    }
};

Process::Process() = default;
Process::~Process() = default;
Process::Process(Process&& other) noexcept = default;
Process& Process::operator=(Process&& other) noexcept = default;

std::error_code Process::start(std::vector<std::string> command, const std::vector<std::string>& environment,
                               const Streams& streams, ProcessGroup group, Orphan orphan) {
    const fs::path program = with_extension(command[0]);
    std::wstring line = line_of(command), changed = environment_with(environment);
    const Inherited input(streams.input, STD_INPUT_HANDLE, GENERIC_READ),
        output(streams.output, STD_OUTPUT_HANDLE, GENERIC_WRITE),
        errors(streams.errors, STD_ERROR_HANDLE, GENERIC_WRITE);
    StartInfo info(input.get(), output.get(), errors.get());
    // A window's process has no console. A program of the console would open one.
    const DWORD window = GetConsoleWindow() ? 0 : CREATE_NO_WINDOW;
    const DWORD flags = CREATE_SUSPENDED | CREATE_UNICODE_ENVIRONMENT | EXTENDED_STARTUPINFO_PRESENT |
                        window | (group == ProcessGroup::own ? CREATE_NEW_PROCESS_GROUP : 0);
    PROCESS_INFORMATION made{};
    if (!CreateProcessW(program.c_str(), line.data(), nullptr, nullptr, TRUE, flags, changed.data(), nullptr,
                        info.get(), &made))
        return last_error();
    auto state = std::make_unique<State>();
    state->process = made.hProcess;
    state->id = made.dwProcessId;
    state->job = make_job(orphan == Orphan::killed);
    if (state->job) AssignProcessToJobObject(state->job, made.hProcess);
    ResumeThread(made.hThread);
    CloseHandle(made.hThread);
    state_ = std::move(state);
    return {};
}

bool Process::is_open() const {
    return state_ != nullptr;
}

int Process::id() const {
    return state_ ? int(state_->id) : 0;
}

bool Process::has_ended() const {
    return WaitForSingleObject(state_->process, 0) == WAIT_OBJECT_0;
}

ProcessEnd Process::wait() {
    WaitForSingleObject(state_->process, INFINITE);
    DWORD status = 0;
    GetExitCodeProcess(state_->process, &status);
    // Processes that it started and did not wait for keep running.
    JOBOBJECT_EXTENDED_LIMIT_INFORMATION none{};
    if (state_->job)
        SetInformationJobObject(state_->job, JobObjectExtendedLimitInformation, &none, sizeof(none));
    state_.reset();
    return {int(status), 0};
}

void Process::ask_to_end() {
    if (!request_end(state_->id) && !GenerateConsoleCtrlEvent(CTRL_BREAK_EVENT, state_->id)) kill();
}

void Process::kill() {
    if (!state_->job || !TerminateJobObject(state_->job, 1)) TerminateProcess(state_->process, 1);
}

void Process::end(std::chrono::milliseconds patience) {
    ask_to_end();
    WaitForSingleObject(state_->process, DWORD(patience.count()));
    kill();
    wait();
}

std::error_code PipeFrom::open() {
    return open_pipe(from, to);
}

std::error_code PipeTo::open() {
    return open_pipe(from, to);
}

std::error_code PipeTo::write(const void* bytes, size_t size) {
    return to.write(bytes, size);
}

// Pipes cannot be waited for. Those that have something are read without a pause.
bool wait_for(const File& first, const File& second, std::chrono::milliseconds time, bool (&ready)[2]) {
    const auto end = std::chrono::steady_clock::now() + time;
    for (;;) {
        const File* pipes[] = {&first, &second};
        for (int i = 0; i < 2; ++i) {
            bool ended = false;
            ready[i] = pipes[i]->is_open() && (bytes_in(*pipes[i], ended) > 0 || ended);
        }
        if (ready[0] || ready[1]) return true;
        if (std::chrono::steady_clock::now() >= end) return false;
        Sleep(kShortTurn);
    }
}

}  // namespace ewa::platform
