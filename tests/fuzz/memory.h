// SPDX-License-Identifier: Apache-2.0
// The bytes that are allocated at a time, while one input is read.
#pragma once
#if defined(__SANITIZE_ADDRESS__)
#define EWA_SANITIZED
#elif defined(__has_feature)
#if __has_feature(address_sanitizer)
#define EWA_SANITIZED
#endif
#endif
#ifdef EWA_SANITIZED
#include <sanitizer/allocator_interface.h>
#else
#include <malloc.h>
#endif

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <cstdio>
#include <cstdlib>

namespace ewa::fuzz {

inline std::atomic<long long> live{0}, peak{0};

inline void on_malloc(const volatile void* pointer, size_t size) {
    if (!pointer) return;
    const long long now = live += static_cast<long long>(size);
    if (now > peak) peak = now;
}
inline void on_free(const volatile void* pointer) {
    if (!pointer) return;
    void* block = const_cast<void*>(pointer);
#ifdef EWA_SANITIZED
    live -= static_cast<long long>(__sanitizer_get_allocated_size(block));
#else
    live -= static_cast<long long>(malloc_usable_size(block));
#endif
}

/// Without the sanitizer, the program calls on_malloc and on_free itself.
inline void watch_memory() {
#ifdef EWA_SANITIZED
    static const bool installed = __sanitizer_install_malloc_and_free_hooks(on_malloc, on_free) != 0;
    if (!installed) std::abort();
#endif
}

/// Ends the program where more than 4 times the file and 64 MiB were held at once.
inline void require_modest(size_t file_bytes, long long before) {
    const long long most = 4 * static_cast<long long>(file_bytes) + (64ll << 20);
    if (peak - before <= most) return;
    std::fprintf(stderr, "memory: %lld bytes for a file of %zu\n", peak - before, file_bytes);
    std::abort();
}

}  // namespace ewa::fuzz
