// SPDX-License-Identifier: Apache-2.0
#include "support/file_limit.h"

#ifdef _WIN32

namespace ewa::test {

struct FileLimit::State {};
FileLimit::FileLimit(uint64_t) {}
FileLimit::~FileLimit() = default;
bool FileLimit::exists() {
    return false;
}

}  // namespace ewa::test

#else
#include <sys/resource.h>

#include <csignal>

namespace ewa::test {

struct FileLimit::State {
    rlimit before{};
    void (*handler)(int) = nullptr;
};

FileLimit::FileLimit(uint64_t bytes) : state_(std::make_unique<State>()) {
    getrlimit(RLIMIT_FSIZE, &state_->before);
    state_->handler = std::signal(SIGXFSZ, SIG_IGN);
    const rlimit limit{bytes, state_->before.rlim_max};
    setrlimit(RLIMIT_FSIZE, &limit);
}

FileLimit::~FileLimit() {
    setrlimit(RLIMIT_FSIZE, &state_->before);
    std::signal(SIGXFSZ, state_->handler);
}

bool FileLimit::exists() {
    return true;
}

}  // namespace ewa::test

#endif
