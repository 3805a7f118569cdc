// SPDX-License-Identifier: Apache-2.0
// The work that a scene and a request do not need. It is skipped, and takes no memory.
#pragma once
#include <cstdint>
#include <string>

namespace ewa {

/// One thing that a plan skips. `ewa info --verbose` and the report of a run show it.
struct PlanLine {
    std::string what;          // e.g. "SH degrees above 0"
    std::string why;           // the property of the scene or request
    uint64_t bytes_saved = 0;  // of device memory
};

}  // namespace ewa
