// SPDX-License-Identifier: Apache-2.0
#include "edit/filters.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <limits>
#include <optional>

#include "core/text.h"
#include "core/typing.h"
#include "ewa/error.h"
#include "ewa/splat_edit.h"
#include "scene/splat_groups.h"
#include "shared/constants.h"

namespace ewa::edit {
namespace {

/// A group of fewer splats that touches nothing else floats. Small things of a trained scene have more.
constexpr uint32_t kLeastGroup = 10;

constexpr Column kColumns[] = {
    {"x", [](const Gaussians& g, size_t i) { return g.world_mean(i).x; }},
    {"y", [](const Gaussians& g, size_t i) { return g.world_mean(i).y; }},
    {"z", [](const Gaussians& g, size_t i) { return g.world_mean(i).z; }},
    {"opacity", opacity_of},
    {"scale", [](const Gaussians& g, size_t i) { return scale_of(g, i); }, true},
    {"thickness", [](const Gaussians& g, size_t i) { return scale_of(g, i, false); }, true},
    {"red", [](const Gaussians& g, size_t i) { return color_of(g, i).r; }},
    {"green", [](const Gaussians& g, size_t i) { return color_of(g, i).g; }},
    {"blue", [](const Gaussians& g, size_t i) { return color_of(g, i).b; }},
};

/// Whether each splat meets the condition.
template <class Condition>
std::vector<bool> splats_with(const Gaussians& gaussians, const Condition& condition) {
    std::vector<bool> stay(gaussians.size());
    for (size_t i = 0; i < stay.size(); ++i) stay[i] = condition(i);
    return stay;
}

struct Range {
    double low, high;
    bool has(double value) const { return value >= low && value <= high; }
};

[[noreturn]] void refuse_filter(const std::string& what, const std::string& text, const std::string& why) {
    throw InputError(what + ": '" + text + "' is not COLUMN=LOW..HIGH with " + why);
}

/// text: "LOW..HIGH".
std::optional<Range> parse_range(std::string_view text) {
    const size_t dots = text.find("..");
    if (dots == std::string_view::npos) return std::nullopt;
    const std::string_view low = core::trim(text.substr(0, dots)), high = core::trim(text.substr(dots + 2));
    if (low.empty() && high.empty()) return std::nullopt;
    constexpr double kFar = std::numeric_limits<double>::infinity();
    const auto bound = [](std::string_view word, double none) {
        return word.empty() ? none : core::parse_number(word).value_or(std::nan(""));
    };
    return Range{bound(low, -kFar), bound(high, kFar)};
}

Filter parse_sphere(const std::string& text, const std::string& what) {
    const auto n = core::parse_list(text);
    if (!n || n->size() != 4 || n->back() <= 0)
        throw InputError(what + ": '" + text + "' is not x,y,z,radius: three finite numbers and one above 0");
    const glm::dvec3 center((*n)[0], (*n)[1], (*n)[2]);
    const double radius = n->back();
    return [=](const Gaussians& g, const Cameras&) {
        return splats_with(g, [&](size_t i) {
            const glm::dvec3 from = g.world_mean(i) - center;
            return glm::dot(from, from) <= radius * radius;
        });
    };
}

Filter parse_box(const std::string& text, const std::string& what) {
    const auto box = core::parse_box(text);
    if (!box) throw InputError(what + ": " + core::not_a_box(text));
    return [box = *box](const Gaussians& g, const Cameras&) {
        return splats_with(g, [&](size_t i) {
            const glm::dvec3 at = g.world_mean(i);
            bool inside = true;
            for (int axis = 0; axis < 3; ++axis)
                inside = inside && at[axis] >= box[size_t(axis)] && at[axis] <= box[size_t(axis) + 3];
            return inside;
        });
    };
}

Filter filter_of(const Column& column, const Range& range) {
    return [=](const Gaussians& g, const Cameras&) {
        return splats_with(g, [&](size_t i) { return range.has(column.value(g, i)); });
    };
}

/// Refuses what only the cameras or photos of a run can say.
[[noreturn]] void refuse_without_run(const std::string& what, const char* unknown) {
    throw InputError(what + ": " + unknown +
                     " are known of the folder of a training run alone, before its splats move or others "
                     "join them");
}

Filter filter_of_views(const Range& range, const std::string& what) {
    return [=](const Gaussians& g, const Cameras& cameras) {
        if (!cameras) refuse_without_run(what, kViews);
        const std::vector<uint32_t> views = scene::views_of_splats(g, cameras());
        return splats_with(g, [&](size_t i) { return range.has(views[i]); });
    };
}

}  // namespace

double scale_of(const Gaussians& g, size_t i, bool largest) {
    const auto [low, high] =
        std::minmax({g.log_scales[3 * i], g.log_scales[3 * i + 1], g.log_scales[3 * i + 2]});
    return std::exp(double(largest ? high : low));
}

double opacity_of(const Gaussians& g, size_t i) {
    return 1 / (1 + std::exp(-double(g.opacity_logits[i])));
}

glm::dvec3 color_of(const Gaussians& gaussians, size_t i) {
    const float* sh = &gaussians.sh[gaussians.sh_stride() * i];
    return shared::COLOR_OFFSET + shared::SH_C0 * glm::dvec3(sh[0], sh[1], sh[2]);
}

std::span<const Column> columns() {
    return kColumns;
}

Filter parse_filter(const std::string& text, const std::string& what) {
    const size_t equals = std::min(text.find('='), text.size());
    const std::string name(core::trim(std::string_view(text).substr(0, equals)));
    const std::string value = equals < text.size() ? text.substr(equals + 1) : "";
    if (equals < text.size() && name == "box") return parse_box(value, what);
    if (equals < text.size() && name == "sphere") return parse_sphere(value, what);
    const auto range = parse_range(value);
    if (!range) refuse_filter(what, text, "one bound or both");
    if (!(range->low <= range->high))
        refuse_filter(what, text, "numbers of which the first is not above the second");
    if (name == kViews) return filter_of_views(*range, what);
    std::vector<std::string> known{"box", "sphere", kViews};
    for (const Column& column : kColumns) {
        if (name == column.name) return filter_of(column, *range);
        known.emplace_back(column.name);
    }
    std::rotate(known.begin(), known.begin() + 3, known.end());
    refuse_filter(what, text,
                  fmt::format("a column of {}{}", fmt::join(known, ", "), core::did_you_mean(name, known)));
}

std::vector<bool> drawable_splats(const Gaussians& gaussians) {
    return splats_with(gaussians, [&](size_t i) { return drawable(gaussians, i); });
}

std::vector<bool> grounded_splats(const Gaussians& gaussians) {
    const scene::SplatGroups groups = scene::touching_groups(gaussians);
    return splats_with(gaussians, [&](size_t i) { return groups.sizes[groups.of[i]] >= kLeastGroup; });
}

std::vector<bool> contradicted_splats(const Gaussians& gaussians, const std::vector<uint32_t>& left,
                                      const Cameras& cameras, const std::string& what) {
    if (!cameras.contradicted) refuse_without_run(what, "photos");
    return cameras.contradicted(gaussians, left);
}

std::vector<bool> largest_cluster(const Gaussians& gaussians) {
    const scene::SplatGroups groups = scene::touching_groups(gaussians);
    return splats_with(gaussians, [&](size_t i) { return groups.of[i] == 0; });
}

Gaussians with_removed_in_red(const Gaussians& all, const std::vector<uint32_t>& left) {
    Gaussians shown = all;
    set_sh_degree(shown, 0);
    constexpr double kRed[3] = {1, 0.1, 0.05};
    size_t next = 0;
    for (size_t i = 0; i < all.size(); ++i) {
        const bool stays = next < left.size() && left[next] == i;
        next += stays;
        const glm::dvec3 color = color_of(all, i);
        const double light = (color.r + color.g + color.b) / 3;
        for (size_t c = 0; c < 3; ++c)
            shown.sh[3 * i + c] =
                float(((stays ? 0.1 + 0.5 * light : kRed[c]) - shared::COLOR_OFFSET) / shared::SH_C0);
    }
    return shown;
}

}  // namespace ewa::edit
