// SPDX-License-Identifier: Apache-2.0
#include "io/splats/output_options.h"

#include <cmath>
#include <vector>

#include "core/typing.h"
#include "ewa/error.h"
#include "io/splats/format_table.h"
#include "io/splats/tileset.h"

namespace ewa::io {

namespace {

std::optional<glm::dmat4> parse_geo(const std::string& text) {
    if (text.empty()) return std::nullopt;
    if (text == "ecef") return glm::dmat4(1);
    std::vector<double> values = core::parse_list(text).value_or(std::vector<double>());
    if (values.size() < 3 || values.size() > 4 || std::abs(values[0]) > 90 || std::abs(values[1]) > 360)
        throw InputError(
            "--geo: '" + core::one_line(text.substr(0, 100)) +
            "' is neither ecef nor latitude,longitude,height[,heading] in degrees and metres, such as "
            "47.37,8.54,410");
    values.resize(4);
    return earth_of_place({values[0], values[1], values[2], values[3]});
}

void check_options(const FormatRow& row, const OutputOptions& options) {
    const bool page = row.format == SplatFormat::page;
    if (!options.geo.empty() && !row.place) throw InputError("--geo: only a tileset.json is on a globe");
    if (!options.title.empty() && !page) throw InputError("--title: only a page has one");
    if (options.unbundled && !page) throw InputError("--unbundled: only a page has its scene inside");
    if (options.levels > 0 && !row.levels && !options.unbundled)
        throw InputError(
            "--levels: only a lod-meta.json, a tileset.json and an --unbundled page have levels");
    if (options.spz_version > 0 && (row.format == SplatFormat::tileset || options.gltf_spz))
        throw InputError("--spz-version: a glTF and tiles hold SPZ 2; only an .spz has a version to choose");
    if (options.spz_version > 0 && !row.spz_version) throw InputError("--spz-version: only an .spz has one");
    if (options.gltf_spz && !row.holds_spz)
        throw InputError("--gltf-spz: only a .glb or .gltf can hold an SPZ");
}

}  // namespace

void set_output_options(SaveOptions& save, const std::filesystem::path& file, const OutputOptions& options) {
    save.earth = parse_geo(options.geo);
    check_options(row_to_write(file), options);
    if (options.spz_version > 0) save.spz_version = options.spz_version;
    save.gltf_spz = options.gltf_spz;
    save.levels = options.levels;
    save.page.title = options.title;
    save.page.unbundled = options.unbundled;
}

}  // namespace ewa::io
