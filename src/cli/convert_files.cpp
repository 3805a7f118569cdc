// SPDX-License-Identifier: Apache-2.0
#include "cli/convert_files.h"

#include <set>

#include "core/text.h"
#include "ewa/error.h"
#include "io/splats/format_table.h"
#include "io/splats/scene_page.h"
#include "platform/file.h"

namespace ewa::cli {

namespace fs = std::filesystem;

std::vector<fs::path> values_of(const fs::path& path) {
    const io::FormatRow* row = io::row_of_name(path);
    return row && row->values ? row->values(path) : std::vector<fs::path>();
}

std::vector<fs::path> parts_of(const fs::path& out, bool unbundled) {
    if (!unbundled) return values_of(out);
    const fs::path levels = io::levels_of_page(out);
    std::vector<fs::path> files = values_of(levels);
    files.insert(files.begin(), levels);
    return files;
}

uint64_t bytes_of(const std::vector<fs::path>& files) {
    uint64_t sum = 0;
    std::set<platform::FileId> counted;
    for (const fs::path& file : files) {
        std::error_code absent;
        const uint64_t bytes = fs::file_size(file, absent);
        const auto id = platform::file_id(file);
        if (id && !absent && counted.insert(*id).second) sum += bytes;
    }
    return sum;
}

void check_not_a_part(const fs::path& out, const fs::path& input) {
    const io::FormatRow& row = io::row_to_write(out);
    const fs::path folder = fs::weakly_canonical(input).parent_path();
    if (row.names_part && row.names_part(folder.filename().string()) &&
        folder.parent_path() == fs::weakly_canonical(out).parent_path())
        throw InputError(core::one_line(out.string()) + ": would replace its parts, of which an input, " +
                         core::one_line(input.string()) + ", is one; write to another folder");
}

}  // namespace ewa::cli
