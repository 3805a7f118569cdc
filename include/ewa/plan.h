// SPDX-License-Identifier: Apache-2.0
// What a scene and a request do not need, and so gets no code, memory or time.
#pragma once
#include <cstdint>
#include <string>

namespace ewa {

/// One thing that a plan skips, for `ewa info`, `--verbose` and the report.
struct PlanLine {
    std::string what;
    std::string why;
    uint64_t bytes_saved = 0;
};

}  // namespace ewa
