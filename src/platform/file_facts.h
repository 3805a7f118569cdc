// SPDX-License-Identifier: Apache-2.0
// What the system knows of files: when they were written, and which names are those of one file.
#pragma once
#include <filesystem>
#include <system_error>

namespace ewa::platform {

/// When the file was last written, to 100 ns or better. The C++ library of MinGW knows whole seconds alone.
std::filesystem::file_time_type write_time(const std::filesystem::path& file, std::error_code& error);

/// What is the same for all spellings of a path. POSIX: the path itself. Windows: in capitals, between backslashes.
std::filesystem::path::string_type folded(const std::filesystem::path& path);

}  // namespace ewa::platform
