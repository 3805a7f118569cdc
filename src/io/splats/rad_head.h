// SPDX-License-Identifier: Apache-2.0
// The JSON of a .rad and of its chunks, checked (rad.h).
#pragma once
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/file_reader.h"
#include "io/splats/rad_values.h"

namespace ewa::io {

struct RadChunkPlace {
    uint64_t offset = 0;          // in the file
    uint64_t bytes = UINT64_MAX;  // UINT64_MAX: unknown
    std::optional<std::filesystem::path>
        file;  // of the chunk alone; relative to the folder of the .rad, and inside it
};

struct RadHead {
    uint64_t count = 0, chunk_size = 0;  // splats
    uint64_t codes = 0;                  // of SH
    int sh_degree = 0;
    bool tree = false;
    std::string comment;
    std::vector<RadChunkPlace> chunks;  // as many as count and chunk_size ask for
};

/// Reads the header. Throws InputError.
RadHead read_rad_head(core::FileReader& reader, const std::filesystem::path& folder);

struct RadProperty {
    RadEncoding encoding = RadEncoding::f32;
    bool deflated = false;
    size_t numbers = 0;              // of each splat
    uint64_t offset = 0, bytes = 0;  // in the file
    double min = 0, max = 0;
};
using RadProperties = std::map<std::string, RadProperty, std::less<>>;

/// Reads the head of the chunk at the reader's position. base, count: the splats that it must have. Throws InputError.
RadProperties read_rad_chunk_head(core::FileReader& reader, uint64_t base, uint64_t count);

}  // namespace ewa::io
