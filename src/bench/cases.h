// SPDX-License-Identifier: Apache-2.0
// The fixed set of cases. A case's name says all of it: figures of two machines or two commits are compared
// by name.
#pragma once
#include <cstdint>
#include <string>
#include <vector>

namespace ewa::bench {

enum class Kind {
    forward,     // one picture
    train,       // forward, loss, backward, update
    sort,        // stable radix sort of random 32-bit keys with 32-bit values
    update,      // projection backward and Adam alone, on the slots of one training frame
    first_step,  // a new process until its first training step is done
};

enum class Layout {
    capture,  // a few large objects before a backdrop, as photographs of a table or a room give them
    cloud,    // many small objects at many depths
    sparse,   // cloud with small opaque splats: few a pixel
    dense,    // cloud with large faint splats: many a pixel, and none of them closes it
};

struct Case {
    std::string name;
    Kind kind = Kind::forward;
    Layout layout = Layout::cloud;
    uint32_t splats = 0;  // of a sort: pairs
    int width = 0, height = 0;
    int sh_degree = 0;
    bool large = false;  // only with --large: takes gigabytes or many seconds on a CPU
};

std::vector<Case> all_cases();

/// Whether a name is meant by patterns as select_cases takes them.
bool name_matches(const std::string& name, const std::string& patterns);

/// Patterns separated by commas; one that holds * or ? must match the whole name, another any part of it.
/// Empty: all but the large ones, unless `large`. A pattern names large cases too. Throws InputError where
/// nothing matches.
std::vector<Case> select_cases(const std::string& patterns, bool large);

}  // namespace ewa::bench
