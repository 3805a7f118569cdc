// SPDX-License-Identifier: Apache-2.0
// The two ways an ewa function fails. Anything else that throws is a bug.
#pragma once
#include <stdexcept>
#include <string>

namespace ewa {

/// Wrong use or unreadable input. The command line ends with exit status 2. The text is one line that says
/// what, where (file, line or byte, frame or splat index) and what would help.
class InputError : public std::runtime_error {
  public:
    using std::runtime_error::runtime_error;
};

/// Something failed while running: device, memory, disk. The command line ends with exit status 1.
class RunError : public std::runtime_error {
  public:
    using std::runtime_error::runtime_error;
};

}  // namespace ewa
