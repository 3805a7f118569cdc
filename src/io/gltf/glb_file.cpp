// SPDX-License-Identifier: Apache-2.0
#include "io/gltf/glb_file.h"

#include <limits>

#include "ewa/error.h"
#include "io/gltf/document.h"

namespace ewa::io {

void write_glb(const std::filesystem::path& path, std::string json, uint64_t bytes, std::string_view advice,
               const ValueWriter& write_values) {
    json.resize((json.size() + 3) / 4 * 4, ' ');
    const uint64_t total = 12 + 8 + json.size() + 8 + bytes;
    if (total > std::numeric_limits<uint32_t>::max())
        throw InputError(path.string() + ": a .glb is limited to 4 GiB, and this one would have " +
                         std::to_string(total) + " bytes; " + std::string(advice));
    core::AtomicFile file(path);
    const uint32_t head[5] = {kGlbMagic, 2, uint32_t(total), uint32_t(json.size()), kGlbJson};
    file.write(head, sizeof(head));
    file.write(json);
    const uint32_t chunk[2] = {uint32_t(bytes), kGlbBin};
    file.write(chunk, sizeof(chunk));
    write_values(file);
    file.commit();
}

}  // namespace ewa::io
