// SPDX-License-Identifier: Apache-2.0
// What the system knows of files: when they were written.
#pragma once
#include <filesystem>
#include <system_error>

namespace ewa::platform {

/// When the file was last written, to 100 ns or better. The C++ library of MinGW knows whole seconds alone.
std::filesystem::file_time_type write_time(const std::filesystem::path& file, std::error_code& error);

}  // namespace ewa::platform
