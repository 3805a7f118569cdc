// SPDX-License-Identifier: Apache-2.0
// A limit on the size of files, which ends writes where a full disk does.
#pragma once
#include <cstdint>
#include <memory>

namespace ewa::test {

/// While it lives, no file of this process grows beyond so many bytes.
class FileLimit {
  public:
    explicit FileLimit(uint64_t bytes);
    ~FileLimit();

    /// Whether the system has such a limit. Windows has none.
    static bool exists();

  private:
    struct State;
    std::unique_ptr<State> state_;
};

}  // namespace ewa::test
