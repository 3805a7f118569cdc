// SPDX-License-Identifier: Apache-2.0
#include "platform/signals.h"

#include <atomic>
#include <mutex>

#include "platform/windows/requests.h"
#include "platform/windows/windows.h"

namespace ewa::platform {
namespace {

constexpr int kAsked = 100;                   // the number of a request by another process
constexpr UINT kEndedByControl = 0xC000013A;  // STATUS_CONTROL_C_EXIT
constexpr DWORD kTimeOfShutdown = 30'000;     // ms, more than Windows gives

std::atomic<RequestHandler> handler_now = nullptr;
static_assert(std::atomic<RequestHandler>::is_always_lock_free);

BOOL WINAPI take_request(DWORD request) {
    const RequestHandler handler = handler_now;
    if (!handler) return FALSE;
    handler(int(request));
    // Windows ends the process when this returns. The other threads save meanwhile.
    if (request == CTRL_CLOSE_EVENT || request == CTRL_LOGOFF_EVENT || request == CTRL_SHUTDOWN_EVENT)
        Sleep(kTimeOfShutdown);
    return TRUE;
}

void CALLBACK take_event(void*, BOOLEAN) {
    const RequestHandler handler = handler_now;
    handler ? handler(kAsked) : end_by(kAsked);
}

/// From the first handler on, requests come here.
void listen() {
    static std::once_flag once;
    std::call_once(once, [] {
        SetConsoleCtrlHandler(take_request, TRUE);
        HANDLE event = CreateEventW(nullptr, FALSE, FALSE, request_name(GetCurrentProcessId()).c_str());
        HANDLE waiting = nullptr;
        if (event)
            RegisterWaitForSingleObject(&waiting, event, take_event, nullptr, INFINITE,
                                        WT_EXECUTELONGFUNCTION);
    });
}

std::atomic<DWORD> in_front = 0;  // the program that gets the requests of other processes; 0: none

/// A program on the same console gets Ctrl-C by itself.
void pass_on(int request) {
    if (const DWORD program = request == kAsked ? in_front.load() : 0) request_end(program);
}

}  // namespace

std::wstring request_name(DWORD process) {
    return L"Local\\ewa-end-" + std::to_wstring(process);
}

bool request_end(DWORD process) {
    HANDLE event = OpenEventW(EVENT_MODIFY_STATE, FALSE, request_name(process).c_str());
    if (!event) return false;
    const bool asked = SetEvent(event) != 0;
    CloseHandle(event);
    return asked;
}

struct HandledRequests::State {
    RequestHandler before = nullptr;
};

HandledRequests::HandledRequests(RequestHandler handler, Ignored) : state_(std::make_unique<State>()) {
    listen();
    state_->before = handler_now.exchange(handler);
}

HandledRequests::~HandledRequests() {
    if (state_) handler_now = state_->before;
}

void HandledRequests::keep() {
    state_.reset();
}

bool is_interrupt(int request) {
    return request == CTRL_C_EVENT;
}

void end_by(int) {
    TerminateProcess(GetCurrentProcess(), kEndedByControl);
}

void write_errors_now(std::string_view text) {
    DWORD written = 0;
    WriteFile(GetStdHandle(STD_ERROR_HANDLE), text.data(), DWORD(text.size()), &written, nullptr);
}

void let_large_writes_fail() {}

ProcessEnd run_in_front(const std::vector<std::string>& command, std::error_code& error) {
    const HandledRequests passing(pass_on, Ignored::stay_ignored);
    Process program;
    error = program.start(command, {}, {.output = kOwn}, ProcessGroup::shared);
    if (error) return {};
    in_front = DWORD(program.id());
    const ProcessEnd ended = program.wait();
    in_front = 0;
    return ended;
}

}  // namespace ewa::platform
