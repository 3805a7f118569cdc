// SPDX-License-Identifier: Apache-2.0
#include "cli/convert_tiles.h"

#include <cmath>

#include "core/text.h"
#include "core/typing.h"
#include "ewa/error.h"
#include "ewa/splat_edit.h"
#include "io/splats/tileset.h"
#include "scene/splat_arrays.h"

namespace ewa::cli {

bool names_tileset(const std::filesystem::path& path) {
    return core::lower(path.filename().string()) == io::kTilesetName;
}

std::optional<glm::dmat4> parse_geo(const std::string& text) {
    if (text.empty()) return std::nullopt;
    if (text == "ecef") return glm::dmat4(1);
    std::vector<double> values;
    bool numbers = true;
    for (size_t begin = 0, end = 0; begin <= text.size(); begin = end + 1) {
        end = std::min(text.find(',', begin), text.size());
        const auto value = core::parse_number(core::trim(std::string_view(text).substr(begin, end - begin)));
        numbers = numbers && value && std::isfinite(*value);
        values.push_back(value.value_or(0));
    }
    if (!numbers || values.size() < 3 || values.size() > 4 || std::abs(values[0]) > 90 ||
        std::abs(values[1]) > 360)
        throw InputError(
            "--geo: '" + core::one_line(text.substr(0, 100)) +
            "' is neither ecef nor latitude,longitude,height[,heading] in degrees and metres, such as "
            "47.37,8.54,410");
    values.resize(4);
    return io::earth_of_place({values[0], values[1], values[2], values[3]});
}

std::vector<std::string> write_tiles(const std::filesystem::path& path, Gaussians gaussians,
                                     const SaveOptions& options, const std::optional<glm::dmat4>& earth) {
    std::vector<std::string> remarks;
    if (gaussians.density) {
        fit_opacities(gaussians, false);
        remarks.emplace_back("opacities of --kernel density are fitted to 3DGS's kernel");
    }
    std::vector<uint32_t> kept;
    for (size_t i = 0; i < gaussians.size(); ++i)
        if (drawable(gaussians, i)) kept.push_back(uint32_t(i));
    if (kept.size() < gaussians.size()) {
        remarks.push_back(core::counted(gaussians.size() - kept.size(), "splat") +
                          " with a value that is not finite or a zero quaternion: skipped (" +
                          scene::undrawable_text(gaussians) + ")");
        keep_splats(gaussians, kept);
    }
    if (!scene::is_computable(gaussians)) gaussians = scene::computable(std::move(gaussians));
    const std::vector<std::string> more =
        io::write_tileset(path, std::move(gaussians), {.save = options, .earth = earth});
    remarks.insert(remarks.end(), more.begin(), more.end());
    if (!options.comments.empty()) remarks.emplace_back("comments are dropped");
    return remarks;
}

}  // namespace ewa::cli
