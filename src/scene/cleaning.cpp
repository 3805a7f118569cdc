// SPDX-License-Identifier: Apache-2.0
#include "scene/cleaning.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <optional>

#include "core/text.h"
#include "core/typing.h"
#include "ewa/error.h"
#include "ewa/splat_edit.h"
#include "scene/splat_groups.h"
#include "shared/constants.h"

namespace ewa::scene {
namespace {

/// A group of fewer splats that touches nothing else floats. Small things of a trained scene have more.
constexpr uint32_t kLeastGroup = 10;

using Keep = std::function<bool(size_t)>;

double scale_of(const Gaussians& g, size_t i, bool largest) {
    const auto [low, high] =
        std::minmax({g.log_scales[3 * i], g.log_scales[3 * i + 1], g.log_scales[3 * i + 2]});
    return std::exp(double(largest ? high : low));
}

double color_of(const Gaussians& g, size_t i, size_t channel) {
    return shared::COLOR_OFFSET + shared::SH_C0 * g.sh[g.sh_stride() * i + channel];
}

double opacity_of(const Gaussians& g, size_t i) {
    return 1 / (1 + std::exp(-double(g.opacity_logits[i])));
}

struct Column {
    const char* name;
    double (*value)(const Gaussians&, size_t);
};
constexpr Column kColumns[] = {
    {"x", [](const Gaussians& g, size_t i) { return g.world_mean(i).x; }},
    {"y", [](const Gaussians& g, size_t i) { return g.world_mean(i).y; }},
    {"z", [](const Gaussians& g, size_t i) { return g.world_mean(i).z; }},
    {"opacity", opacity_of},
    {"scale", [](const Gaussians& g, size_t i) { return scale_of(g, i, true); }},
    {"thickness", [](const Gaussians& g, size_t i) { return scale_of(g, i, false); }},
    {"red", [](const Gaussians& g, size_t i) { return color_of(g, i, 0); }},
    {"green", [](const Gaussians& g, size_t i) { return color_of(g, i, 1); }},
    {"blue", [](const Gaussians& g, size_t i) { return color_of(g, i, 2); }},
};

struct Range {
    const Column* column;
    double low, high;
};

Range parse_range(const std::string& text) {
    const auto refuse = [&](const std::string& why) -> Range {
        throw InputError("--keep: '" + text + "' is not COLUMN=LOW..HIGH with " + why);
    };
    const size_t equals = text.find('='), dots = text.find("..", std::min(equals, text.size()));
    if (equals == std::string::npos || dots == std::string::npos) return refuse("one bound or both");
    Range range{};
    std::vector<std::string> known;
    for (const Column& column : kColumns) {
        known.emplace_back(column.name);
        if (text.compare(0, equals, column.name) == 0) range.column = &column;
    }
    if (!range.column)
        return refuse(fmt::format("a column of {}{}", fmt::join(known, ", "),
                                  core::did_you_mean(text.substr(0, equals), known)));
    const std::string low(core::trim(text.substr(equals + 1, dots - equals - 1)));
    const std::string high(core::trim(text.substr(dots + 2)));
    if (low.empty() && high.empty()) return refuse("one bound or both");
    constexpr double kFar = std::numeric_limits<double>::infinity();
    const auto first = low.empty() ? -kFar : core::parse_number(low);
    const auto last = high.empty() ? kFar : core::parse_number(high);
    if (!first || !last || !(*first <= *last))
        return refuse("numbers of which the first is not above the second");
    range.low = *first;
    range.high = *last;
    return range;
}

std::array<double, 4> parse_sphere(const std::string& text) {
    const auto numbers = core::parse_list(text);
    if (!numbers || numbers->size() != 4 || numbers->back() <= 0)
        throw InputError("--crop-sphere: '" + text +
                         "' is not x,y,z,radius: three finite numbers and one above 0");
    return {numbers->at(0), numbers->at(1), numbers->at(2), numbers->at(3)};
}

std::array<double, 6> parse_crop(const std::string& text) {
    const auto box = core::parse_box(text);
    if (!box) throw InputError("--crop: " + core::not_a_box(text));
    return *box;
}

}  // namespace

void check_cleaning(const Cleaning& cleaning) {
    for (const std::string& text : cleaning.ranges) parse_range(text);
    if (!cleaning.sphere.empty()) parse_sphere(cleaning.sphere);
    if (!cleaning.box.empty()) parse_crop(cleaning.box);
}

std::vector<Removed> clean(Gaussians& gaussians, const Cleaning& cleaning,
                           const std::vector<Camera>& cameras) {
    // Wrong use is an error before anything takes time.
    std::vector<Range> ranges;
    for (const std::string& text : cleaning.ranges) ranges.push_back(parse_range(text));
    const auto sphere = cleaning.sphere.empty() ? std::array<double, 4>{} : parse_sphere(cleaning.sphere);

    std::vector<Removed> removed;
    const auto keep_only = [&](const std::string& option, const Keep& keep) {
        std::vector<uint32_t> kept;
        for (size_t i = 0; i < gaussians.size(); ++i)
            if (keep(i)) kept.push_back(uint32_t(i));
        removed.push_back({option, gaussians.size() - kept.size()});
        if (kept.size() < gaussians.size()) keep_splats(gaussians, kept);
    };
    if (cleaning.invalid) keep_only("--remove-invalid", [&](size_t i) { return drawable(gaussians, i); });
    for (const Range& range : ranges)
        keep_only(std::string("--keep ") + range.column->name, [&](size_t i) {
            const double value = range.column->value(gaussians, i);
            return value >= range.low && value <= range.high;
        });
    if (!cleaning.sphere.empty())
        keep_only("--crop-sphere", [&](size_t i) {
            const glm::dvec3 from = gaussians.world_mean(i) - glm::dvec3(sphere[0], sphere[1], sphere[2]);
            return glm::dot(from, from) <= sphere[3] * sphere[3];
        });
    if (cleaning.min_views > 0) {
        const std::vector<uint32_t> views = views_of_splats(gaussians, cameras);
        keep_only("--min-views", [&](size_t i) { return views[i] >= uint32_t(cleaning.min_views); });
    }
    if (cleaning.floaters || cleaning.largest_cluster) {
        const SplatGroups groups = touching_groups(gaussians);
        const auto group = [&](size_t i) { return groups.of[i]; };
        if (cleaning.largest_cluster)
            keep_only("--largest-cluster", [&](size_t i) { return group(i) == 0; });
        else
            keep_only("--remove-floaters", [&](size_t i) { return groups.sizes[group(i)] >= kLeastGroup; });
    }
    if (!cleaning.box.empty())
        keep_only("--crop", [&, box = parse_crop(cleaning.box)](size_t i) {
            const glm::dvec3 at = gaussians.world_mean(i);
            bool inside = true;
            for (int axis = 0; axis < 3; ++axis)
                inside = inside && at[axis] >= box[size_t(axis)] && at[axis] <= box[size_t(axis) + 3];
            return inside;
        });
    if (cleaning.min_opacity > 0)
        keep_only("--min-opacity",
                  [&](size_t i) { return opacity_of(gaussians, i) >= cleaning.min_opacity; });
    return removed;
}

Gaussians with_removed_in_red(const Gaussians& all, const Gaussians& left) {
    Gaussians shown = all;
    set_sh_degree(shown, 0);
    const auto same = [&](size_t i, size_t j) {
        return std::equal(&all.means[3 * i], &all.means[3 * i] + 3, &left.means[3 * j]) &&
               all.opacity_logits[i] == left.opacity_logits[j] &&
               std::equal(&all.log_scales[3 * i], &all.log_scales[3 * i] + 3, &left.log_scales[3 * j]);
    };
    constexpr double kRed[3] = {1, 0.1, 0.05};
    size_t next = 0;
    for (size_t i = 0; i < all.size(); ++i) {
        const bool kept = next < left.size() && same(i, next);
        next += kept;
        const double light = (color_of(all, i, 0) + color_of(all, i, 1) + color_of(all, i, 2)) / 3;
        for (size_t c = 0; c < 3; ++c)
            shown.sh[3 * i + c] =
                float(((kept ? 0.1 + 0.5 * light : kRed[c]) - shared::COLOR_OFFSET) / shared::SH_C0);
    }
    return shown;
}

}  // namespace ewa::scene
