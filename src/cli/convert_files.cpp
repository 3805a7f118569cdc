// SPDX-License-Identifier: Apache-2.0
#include "cli/convert_files.h"

#include <sys/stat.h>

#include <set>
#include <utility>

#include "cli/convert_output.h"
#include "core/text.h"
#include "ewa/error.h"
#include "ewa/splat_files.h"
#include "io/splats/formats.h"
#include "io/splats/levels.h"
#include "io/splats/tileset.h"

namespace ewa::cli {

namespace fs = std::filesystem;

std::vector<fs::path> values_of(const fs::path& path) {
    const std::string name = core::lower(path.filename().string());
    if (name.ends_with(".gltf")) return io::gltf_values(path);
    if (name == "lod-meta.json") return io::level_files(path);
    if (names_tileset(path)) return io::tile_files(path);
    return name == "meta.json" ? io::sog_images(path) : std::vector<fs::path>();
}

std::vector<fs::path> parts_of(const fs::path& out, bool unbundled) {
    if (!unbundled) return values_of(out);
    const fs::path levels = levels_of_page(out);
    std::vector<fs::path> files = values_of(levels);
    files.insert(files.begin(), levels);
    return files;
}

uint64_t bytes_of(const std::vector<fs::path>& files) {
    uint64_t sum = 0;
    std::set<std::pair<dev_t, ino_t>> counted;
    for (const fs::path& file : files)
        if (struct stat found{};
            stat(file.c_str(), &found) == 0 && counted.emplace(found.st_dev, found.st_ino).second)
            sum += uint64_t(found.st_size);
    return sum;
}

void check_not_a_part(const fs::path& out, const fs::path& input) {
    const fs::path folder = fs::weakly_canonical(input).parent_path();
    const std::string name = folder.filename().string();
    if ((names_tileset(out) ? io::names_tile_folder(name) : io::names_chunk_folder(name)) &&
        folder.parent_path() == fs::weakly_canonical(out).parent_path())
        throw InputError(core::one_line(out.string()) + ": would replace its parts, of which an input, " +
                         core::one_line(input.string()) + ", is one; write to another folder");
}

std::string_view format_text(const fs::path& out) {
    if (names_page(out)) return "page";
    return names_tileset(out) ? "3D Tiles" : name_of(format_of_name(out));
}

}  // namespace ewa::cli
