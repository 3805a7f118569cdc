// SPDX-License-Identifier: Apache-2.0
#include "edit/shapes.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <limits>
#include <optional>

#include "core/text.h"
#include "core/typing.h"
#include "edit/view_shapes.h"
#include "scene/splat_groups.h"

namespace ewa::edit {
namespace {

constexpr double kFloodedSizes = 4;  // of the first splat: the largest ones of a flood

std::vector<double> numbers_of(const std::string& what, const std::string& text, const std::string& value,
                               size_t least, const std::string& form, size_t more = 0) {
    const auto n = core::parse_list(value);
    if (!n || n->size() < least || n->size() > least + more) refuse_shape(what, text, form);
    return *n;
}

/// The selectable splats as a scene of their own, and where they are in the whole one.
struct Part {
    Gaussians splats;
    std::vector<uint32_t> indices;
};

template <class Condition>
Part part_of(const EditedSplats& all, const Condition& belongs) {
    Part part;
    for (size_t i = 0; i < all.size(); ++i)
        if (all.selectable(i) && belongs(i)) part.indices.push_back(uint32_t(i));
    const Gaussians& from = *all.splats();
    part.splats.sh_degree = 0;  // groups do not depend on colours
    part.splats.origin = from.origin;
    part.splats.resize(part.indices.size());
    const size_t stride = from.sh_stride();
    for (size_t k = 0; k < part.indices.size(); ++k) {
        const size_t i = part.indices[k];
        std::copy_n(&from.means[3 * i], 3, &part.splats.means[3 * k]);
        std::copy_n(&from.quaternions[4 * i], 4, &part.splats.quaternions[4 * k]);
        std::copy_n(&from.log_scales[3 * i], 3, &part.splats.log_scales[3 * k]);
        part.splats.opacity_logits[k] = from.opacity_logits[i];
        std::copy_n(&from.sh[stride * i], 3, &part.splats.sh[3 * k]);
    }
    return part;
}

Part whole(const EditedSplats& all) {
    return part_of(all, [](size_t) { return true; });
}

/// Takes the splats of a part whose flag is set.
std::vector<bool> taken(const EditedSplats& all, const Part& part, const std::vector<bool>& flags) {
    std::vector<bool> result(all.size());
    for (size_t k = 0; k < flags.size(); ++k)
        if (flags[k]) result[part.indices[k]] = true;
    return result;
}

bool like(const glm::dvec3& a, const glm::dvec3& b, double tolerance) {
    return std::abs(a.x - b.x) <= tolerance && std::abs(a.y - b.y) <= tolerance &&
           std::abs(a.z - b.z) <= tolerance;
}

/// The splat of the part whose mean is nearest.
std::optional<size_t> nearest_to(const Part& part, const glm::dvec3& point) {
    std::optional<size_t> nearest;
    double least = std::numeric_limits<double>::infinity();
    for (size_t k = 0; k < part.splats.size(); ++k) {
        const glm::dvec3 from = part.splats.world_mean(k) - point;
        const double distance = glm::dot(from, from);
        if (!(distance < least)) continue;
        least = distance;
        nearest = k;
    }
    return nearest;
}

/// The group of touching splats of a part that the nearest one to a point is in.
std::vector<bool> group_at(const EditedSplats& all, const Part& part, const glm::dvec3& point) {
    const auto seed = nearest_to(part, point);
    if (!seed) return std::vector<bool>(all.size());
    const scene::SplatGroups groups = scene::touching_groups(part.splats);
    std::vector<bool> flags(part.splats.size());
    for (size_t k = 0; k < flags.size(); ++k) flags[k] = groups.of[k] == groups.of[*seed];
    return taken(all, part, flags);
}

Shape cluster(const glm::dvec3& point) {
    return [=](const EditedSplats& all) { return group_at(all, whole(all), point); };
}

/// opacity: the least of a splat that is taken; with it, none is much larger than the first one.
Shape flood(const glm::dvec3& point, double tolerance, const std::optional<double>& opacity) {
    return [=](const EditedSplats& all) {
        const Gaussians& g = *all.splats();
        const auto solid = [&](size_t i) { return !opacity || opacity_of(g, i) >= *opacity; };
        const Part everything = part_of(all, solid);
        const auto nearest = nearest_to(everything, point);
        if (!nearest) return std::vector<bool>(all.size());
        const size_t first = everything.indices[*nearest];
        const glm::dvec3 color = color_of(g, first);
        const double largest = kFloodedSizes * scale_of(g, first);
        const Part part = part_of(all, [&](size_t i) {
            return solid(i) && !(opacity && scale_of(g, i) > largest) &&
                   like(color_of(g, i), color, tolerance);
        });
        return group_at(all, part, point);  // none if the first colour is not finite
    };
}

Shape small_groups(bool all_but_largest) {
    return [=](const EditedSplats& all) {
        const Part part = whole(all);
        std::vector<bool> flags =
            all_but_largest ? largest_cluster(part.splats) : grounded_splats(part.splats);
        flags.flip();
        return taken(all, part, flags);
    };
}

/// The selected splats and those near them, or the selected ones that are not near others.
Shape resized(double radius, bool grow) {
    return [=](const EditedSplats& all) {
        std::vector<bool> some(all.size());
        for (size_t i = 0; i < all.size(); ++i) some[i] = all.selectable(i) && all.affected(i) == grow;
        std::vector<bool> flags = scene::splats_near(*all.splats(), some, radius);
        if (!grow) flags.flip();
        return flags;
    };
}

Shape of_filter(const Filter& filter) {
    return [=](const EditedSplats& all) { return filter(*all.splats(), all.cameras()); };
}

Shape same(bool value) {
    return [=](const EditedSplats& all) { return std::vector<bool>(all.size(), value); };
}

Shape inverted() {
    return [](const EditedSplats& all) {
        std::vector<bool> flags(all.size());
        for (size_t i = 0; i < flags.size(); ++i) flags[i] = (all.states()[i] & kSelected) == 0;
        return flags;
    };
}

Shape shape_of_color(const glm::dvec3& color, double tolerance) {
    return [=](const EditedSplats& all) {
        std::vector<bool> flags(all.size());
        for (size_t i = 0; i < flags.size(); ++i)
            flags[i] = like(color_of(*all.splats(), i), color, tolerance);
        return flags;
    };
}

constexpr std::string_view kContradicted = "contradicted";

Shape contradicted(const std::string& what) {
    return [=](const EditedSplats& all) {
        std::vector<uint32_t> left;
        for (size_t i = 0; i < all.first()->size(); ++i)
            if ((all.states()[i] & kDeleted) == 0) left.push_back(uint32_t(i));
        std::vector<bool> flags = contradicted_splats(*all.first(), left, all.cameras(), what);
        flags.resize(all.size());
        return flags;
    };
}

/// text: "3,7,9-12".
Shape listed(const std::string& text, const std::string& what) {
    std::vector<std::pair<uint32_t, uint32_t>> ranges;
    for (const std::string_view word : core::split_list(text)) {
        const size_t dash = std::min(word.find('-'), word.size());
        const auto first = core::parse_integer<uint32_t>(word.substr(0, dash));
        const auto last = dash < word.size() ? core::parse_integer<uint32_t>(word.substr(dash + 1)) : first;
        if (!first || !last || *first > *last)
            throw InputError(what + ": '" + std::string(word.substr(0, 40)) +
                             "' is no number or range of splats=3,7,9-12");
        ranges.emplace_back(*first, *last);
    }
    return [=](const EditedSplats& all) {
        std::vector<bool> flags(all.size());
        for (const auto& [first, last] : ranges) {
            if (last >= all.size())
                throw InputError(fmt::format("{}: there is no splat {} among {}", what, last, all.size()));
            std::fill(flags.begin() + first, flags.begin() + last + 1, true);
        }
        return flags;
    };
}

double radius_of(const std::string& what, const std::string& text, const std::string& value) {
    constexpr const char* kForm = "grow=R or shrink=R with a distance above 0";
    const double radius = numbers_of(what, text, value, 1, kForm).front();
    if (!(radius > 0)) refuse_shape(what, text, kForm);
    return radius;
}

}  // namespace

Shape parse_shape(const std::string& text, const std::string& what) {
    if (text == "all") return same(true);
    if (text == "none") return same(false);
    if (text == "invert") return inverted();
    if (text == "floaters" || text == "far") return small_groups(text == "far");
    if (text == kContradicted) return contradicted(what);
    const size_t equals = std::min(text.find('='), text.size());
    const std::string name = text.substr(0, equals),
                      value = equals < text.size() ? text.substr(equals + 1) : "";
    if (name == "polygon" || name == "brush") return parse_view_shape(text, what);
    if (name == "color" || name == "flood") {
        const bool floods = name == "flood";
        const std::string form = name + (floods ? "=x,y,z,T" : "=r,g,b,T") +
                                 " with a tolerance T of 0 or more" +
                                 (floods ? ", or flood=x,y,z,T,o with a least opacity o from 0 to 1" : "");
        const auto n = numbers_of(what, text, value, 4, form, floods);
        const auto opacity = n.size() > 4 ? std::optional(n[4]) : std::nullopt;
        if (n[3] < 0 || opacity.value_or(0) < 0 || opacity.value_or(0) > 1) refuse_shape(what, text, form);
        const glm::dvec3 at(n[0], n[1], n[2]);
        return floods ? flood(at, n[3], opacity) : shape_of_color(at, n[3]);
    }
    if (name == "splats") return listed(value, what);
    if (name == "cluster") {
        const auto n = numbers_of(what, text, value, 3, "cluster=x,y,z");
        return cluster({n[0], n[1], n[2]});
    }
    if (name == "grow" || name == "shrink") return resized(radius_of(what, text, value), name == "grow");
    if (equals == text.size())
        refuse_shape(what, text,
                     "all, none, invert, floaters, far, contradicted, a filter of --where, color=, flood=, "
                     "cluster=, grow=, shrink=, splats=, "
                     "polygon= or brush=" +
                         core::did_you_mean(
                             text, {"all", "none", "invert", "floaters", "far", std::string(kContradicted)}));
    return of_filter(parse_filter(text, what));
}

Selection parse_selection(const std::string& text, const std::string& what) {
    for (size_t i = 1; i < std::size(kOperationWords); ++i)
        if (const std::string_view word = kOperationWords[i]; text.starts_with(word))
            return {Operation(i), parse_shape(text.substr(word.size()), what)};
    return {Operation::set, parse_shape(text, what)};
}

void select(EditedSplats& splats, const Selection& selection) {
    const std::vector<bool> flags = selection.shape(splats);
    std::vector<uint8_t> states = splats.states();
    for (size_t i = 0; i < states.size(); ++i) {
        if (!splats.selectable(i)) continue;
        const bool before = (states[i] & kSelected) != 0, flag = flags[i];
        bool now = flag;
        if (selection.operation == Operation::add) now = before || flag;
        if (selection.operation == Operation::remove) now = before && !flag;
        if (selection.operation == Operation::intersect) now = before && flag;
        states[i] = uint8_t((states[i] & ~kSelected) | (now ? kSelected : 0));
    }
    splats.set_states(std::move(states));
}

void delete_shape(EditedSplats& splats, const Shape& shape) {
    const std::vector<bool> flags = shape(splats);
    std::vector<uint8_t> states = splats.states();
    for (size_t i = 0; i < states.size(); ++i)
        if (flags[i] && splats.selectable(i)) states[i] = uint8_t((states[i] | kDeleted) & ~kSelected);
    splats.set_states(std::move(states));
}

bool write_contradicted(std::string& selection, const EditedSplats& splats) {
    const size_t at = selection.find(':') + 1;  // behind an operation; 0 without one
    if (std::string_view(selection).substr(at) != kContradicted) return false;
    selection.replace(at, kContradicted.size(),
                      splats_shape(parse_selection(selection.substr(at)).shape(splats)));
    return true;
}

std::string splats_shape(const std::vector<bool>& flags) {
    std::string text;
    for (size_t i = 0; i < flags.size(); ++i) {
        if (!flags[i]) continue;
        size_t last = i;
        while (last + 1 < flags.size() && flags[last + 1]) ++last;
        text.append(text.empty() ? "splats=" : ",").append(std::to_string(i));
        if (last > i) text.append("-").append(std::to_string(last));
        i = last;
    }
    return text.empty() ? "none" : text;
}

std::string box_shape(const glm::dvec3& low, const glm::dvec3& high) {
    return fmt::format("box={:.9g},{:.9g},{:.9g},{:.9g},{:.9g},{:.9g}", low.x, low.y, low.z, high.x, high.y,
                       high.z);
}

std::string sphere_shape(const glm::dvec3& center, double radius) {
    return fmt::format("sphere={:.9g},{:.9g},{:.9g},{:.9g}", center.x, center.y, center.z, radius);
}

}  // namespace ewa::edit
