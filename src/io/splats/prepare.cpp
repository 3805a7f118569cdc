// SPDX-License-Identifier: Apache-2.0
#include "io/splats/prepare.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "core/typing.h"
#include "ewa/splat_edit.h"
#include "io/splats/place.h"
#include "scene/splat_arrays.h"

namespace ewa::io {

namespace {

/// Removes the splats that are never visible, and makes values finite.
void make_drawable(Gaussians& gaussians, std::vector<std::string>& remarks) {
    std::vector<uint32_t> kept;
    for (size_t i = 0; i < gaussians.size(); ++i)
        if (drawable(gaussians, i)) kept.push_back(uint32_t(i));
    if (const uint64_t skipped = gaussians.size() - kept.size(); skipped > 0) {
        remarks.push_back(core::counted(skipped, "splat") + (skipped == 1 ? " has" : " have") +
                          " a value that is not finite or a zero quaternion and " +
                          std::string(core::is_or_are(skipped)) +
                          " skipped: " + scene::undrawable_text(gaussians));
        keep_splats(gaussians, kept);
    }
    if (!scene::is_computable(gaussians)) gaussians = scene::computable(std::move(gaussians));
}

/// Makes world positions the means, rounded to float32.
void round_positions(Gaussians& gaussians) {
    for (size_t i = 0; i < gaussians.size(); ++i) {
        const glm::dvec3 mean = gaussians.world_mean(i);
        for (int axis = 0; axis < 3; ++axis) gaussians.means[3 * i + size_t(axis)] = float(mean[axis]);
    }
    gaussians.origin = glm::dvec3(0);
}

std::string rounding_remark(const glm::dvec3& origin) {
    const double farthest = std::max({std::abs(origin.x), std::abs(origin.y), std::abs(origin.z)});
    const float step = std::nextafter(float(farthest), INFINITY) - float(farthest);
    char text[160];
    std::snprintf(text, sizeof(text),
                  "positions are rounded to %.3g units, float32's step so far from the origin; save a .ply, "
                  "or move the "
                  "scene near the origin with --transform move=",
                  double(step));
    return text;
}

}  // namespace

std::vector<std::string> prepare(Gaussians& gaussians, const FormatRow& row) {
    std::vector<std::string> remarks;
    if (!row.world && gaussians.origin != glm::dvec3(0)) {
        remarks.push_back(rounding_remark(gaussians.origin));
        round_positions(gaussians);
    }
    if (!row.density && gaussians.density) {
        fit_opacities(gaussians, false);
        remarks.emplace_back(
            "opacities of --kernel density are fitted to 3DGS's kernel; a .ply keeps the kernel");
    }
    if (!row.undrawable) make_drawable(gaussians, remarks);
    return remarks;
}

bool is_prepared(const Gaussians& gaussians, const FormatRow& row) {
    if (!row.world && gaussians.origin != glm::dvec3(0)) return false;
    if (!row.density && gaussians.density) return false;
    if (row.undrawable) return true;
    for (size_t i = 0; i < gaussians.size(); ++i)
        if (!drawable(gaussians, i)) return false;
    return scene::is_computable(gaussians);
}

std::vector<std::string> match_file(Gaussians& gaussians, const FormatRow& row) {
    std::vector<std::string> remarks;
    if (!row.undrawable) make_drawable(gaussians, remarks);
    if (row.morton) select_splats(gaussians, morton_order(gaussians));
    return remarks;
}

std::vector<std::string> dropped_remarks(const SaveOptions& options, const FormatRow& row) {
    std::vector<std::string> remarks;
    if (options.antialiased && !row.mark && !(row.holds_spz && options.gltf_spz))
        remarks.emplace_back("the mark that the scene was trained anti-aliased is dropped");
    const auto lost = [&](const std::string& comment) { return !row.place || !is_place_comment(comment); };
    if (!row.comments && std::ranges::any_of(options.comments, lost))
        remarks.emplace_back("comments are dropped");
    return remarks;
}

}  // namespace ewa::io
