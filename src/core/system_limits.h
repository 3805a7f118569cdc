// SPDX-License-Identifier: Apache-2.0
// Limits that the system sets to this process.
#pragma once
#include <cstdint>
#include <string>

namespace ewa::core {

/// "this process may use only 390 MiB of address space (ulimit -v); ", or empty without such a limit. Errors begin with
/// it, because libraries give misleading reasons when address space is short.
std::string address_limit_text();

/// Whether the process could now map so many bytes and also start so many threads.
bool has_room(uint64_t bytes, int threads);

}  // namespace ewa::core
