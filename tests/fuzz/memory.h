// SPDX-License-Identifier: Apache-2.0
// The bytes that are allocated at a time, while one input is read.
#pragma once
#include <sanitizer/allocator_interface.h>

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
    if (pointer)
        live -= static_cast<long long>(__sanitizer_get_allocated_size(const_cast<const void*>(pointer)));
}

inline void watch_memory() {
    static const bool installed = __sanitizer_install_malloc_and_free_hooks(on_malloc, on_free) != 0;
    if (!installed) std::abort();
}

/// Ends the program where more than 4 times the file and 64 MiB were held at once.
inline void require_modest(size_t file_bytes, long long before) {
    const long long most = 4 * static_cast<long long>(file_bytes) + (64ll << 20);
    if (peak - before <= most) return;
    std::fprintf(stderr, "memory: %lld bytes for a file of %zu\n", peak - before, file_bytes);
    std::abort();
}

}  // namespace ewa::fuzz
