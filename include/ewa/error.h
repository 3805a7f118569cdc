// SPDX-License-Identifier: Apache-2.0
// The two errors of ewa's functions. Any other exception is a bug, or lack of memory.
#pragma once
#include <stdexcept>
#include <string>

namespace ewa {

/// Wrong use or unreadable input. The command line ends with exit status 2. The text is one line: what is
/// wrong, where (file, line or byte, frame or splat index), and what would help.
class InputError : public std::runtime_error {
  public:
    using std::runtime_error::runtime_error;
};

/// A failure at run time: device, memory or disk. The command line ends with exit status 1.
class RunError : public std::runtime_error {
  public:
    using std::runtime_error::runtime_error;
};

}  // namespace ewa
