// SPDX-License-Identifier: Apache-2.0
// Limits that the system sets to this process.
#pragma once
#include <cstdint>
#include <string>

namespace ewa::core {

/// "this process may use only 390 MiB of address space (ulimit -v); ", or empty without such a limit. Errors begin with
/// it, because libraries give misleading reasons when address space is short.
std::string address_limit_text();

/// The bytes of address space and of private memory that the process may use (ulimit -v, -d), whichever is less.
uint64_t memory_limit();

/// Whether the process could now map so many bytes and also start so many threads.
bool has_room(uint64_t bytes, int threads);

}  // namespace ewa::core
