// SPDX-License-Identifier: Apache-2.0
// A folder of one's own among the system's temporary files.
#pragma once
#include <filesystem>
#include <string>

namespace ewa::core {

/// Removed at the end, with everything in it.
class TemporaryFolder {
  public:
    /// Its name begins with `prefix`. Throws RunError.
    explicit TemporaryFolder(const std::string& prefix);
    ~TemporaryFolder();
    TemporaryFolder(const TemporaryFolder&) = delete;
    TemporaryFolder& operator=(const TemporaryFolder&) = delete;

    const std::filesystem::path& path() const { return path_; }

  private:
    std::filesystem::path path_;
};

}  // namespace ewa::core
