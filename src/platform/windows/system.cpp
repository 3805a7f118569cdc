// SPDX-License-Identifier: Apache-2.0
#include "platform/system.h"

#include <algorithm>
#include <cstdlib>

#include "platform/windows/windows.h"
// After windows.h.
#include <bcrypt.h>
#include <psapi.h>

namespace ewa::platform {

uint64_t address_limit() {
    JOBOBJECT_EXTENDED_LIMIT_INFORMATION limits{};
    if (!QueryInformationJobObject(nullptr, JobObjectExtendedLimitInformation, &limits, sizeof(limits),
                                   nullptr))
        return UINT64_MAX;
    const DWORD flags = limits.BasicLimitInformation.LimitFlags;
    uint64_t least = UINT64_MAX;
    if (flags & JOB_OBJECT_LIMIT_PROCESS_MEMORY) least = std::min<uint64_t>(least, limits.ProcessMemoryLimit);
    if (flags & JOB_OBJECT_LIMIT_JOB_MEMORY) least = std::min<uint64_t>(least, limits.JobMemoryLimit);
    return least;
}

uint64_t memory_limit() {
    return address_limit();
}

Reservation::Reservation(uint64_t bytes)
    : place_(VirtualAlloc(nullptr, bytes, MEM_RESERVE, PAGE_NOACCESS)), bytes_(bytes) {}

Reservation::~Reservation() {
    if (place_) VirtualFree(place_, 0, MEM_RELEASE);
}

uint64_t installed_memory() {
    MEMORYSTATUSEX memory{};
    memory.dwLength = sizeof(memory);
    return GlobalMemoryStatusEx(&memory) ? memory.ullTotalPhys : 0;
}

std::optional<uint64_t> free_memory() {
    MEMORYSTATUSEX memory{};
    memory.dwLength = sizeof(memory);
    if (!GlobalMemoryStatusEx(&memory)) return std::nullopt;
    return std::min(memory.ullAvailPhys, memory.ullAvailPageFile);
}

uint64_t peak_memory() {
    PROCESS_MEMORY_COUNTERS memory{};
    memory.cb = sizeof(memory);
    return K32GetProcessMemoryInfo(GetCurrentProcess(), &memory, sizeof(memory)) ? memory.PeakWorkingSetSize
                                                                                 : 0;
}

std::string machine_name() {
    wchar_t text[256] = L"";
    DWORD bytes = sizeof(text);
    if (RegGetValueW(HKEY_LOCAL_MACHINE, L"SOFTWARE\\Microsoft\\Cryptography", L"MachineGuid",
                     RRF_RT_REG_SZ | RRF_SUBKEY_WOW6464KEY, nullptr, text, &bytes) == ERROR_SUCCESS)
        return narrow(text);
    DWORD length = DWORD(std::size(text));
    return GetComputerNameExW(ComputerNamePhysicalDnsHostname, text, &length) ? narrow({text, length}) : "";
}

std::string system_release() {
    return "ID=windows";
}

std::vector<uint64_t> usable_cores(size_t words) {
    std::vector<uint64_t> cores(words);
    DWORD_PTR own = 1, all = 0;
    GetProcessAffinityMask(GetCurrentProcess(), &own, &all);
    cores[0] = own ? own : 1;  // 0: the process has threads in several groups
    return cores;
}

bool random_bytes(void* bytes, size_t size) {
    return BCryptGenRandom(nullptr, static_cast<PUCHAR>(bytes), ULONG(size),
                           BCRYPT_USE_SYSTEM_PREFERRED_RNG) == 0;
}

std::string variable(const char* name) {
    const std::wstring wanted = wide(name);
    std::wstring value(GetEnvironmentVariableW(wanted.c_str(), nullptr, 0), L'\0');
    if (value.empty()) return {};
    value.resize(GetEnvironmentVariableW(wanted.c_str(), value.data(), DWORD(value.size())));
    return narrow(value);
}

void set_variable(const char* name, const std::string& value) {
    _wputenv_s(wide(name).c_str(), wide(value).c_str());
}

void set_if_absent(const char* name, const std::string& value) {
    if (GetEnvironmentVariableW(wide(name).c_str(), nullptr, 0) == 0) set_variable(name, value);
}

}  // namespace ewa::platform
