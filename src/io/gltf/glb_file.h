// SPDX-License-Identifier: Apache-2.0
// Writes .glb files: the JSON of a document, and one buffer.
#pragma once
#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <string_view>

#include "core/atomic_file.h"

namespace ewa::io {

using ValueWriter = std::function<void(core::AtomicFile&)>;

/// Writes a temporary file and renames it. bytes: size of the buffer, a multiple of 4. write_values writes its contents.
/// Throws InputError beyond 4 GiB, with `advice` on another format.
void write_glb(const std::filesystem::path& path, std::string json, uint64_t bytes, std::string_view advice,
               const ValueWriter& write_values);

}  // namespace ewa::io
