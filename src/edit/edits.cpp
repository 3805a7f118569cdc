// SPDX-License-Identifier: Apache-2.0
#include "edit/edits.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/gtc/matrix_transform.hpp>
#include <numeric>
#include <utility>

#include "core/text.h"
#include "core/typing.h"
#include "edit/steps.h"
#include "ewa/error.h"
#include "ewa/splat_edit.h"

namespace ewa::edit {
namespace {

/// A number of splats to leave, or a part of them.
struct Decimation {
    double part = 0;  // above 0: of the splats
    size_t count = 0;

    size_t of(size_t splats) const {
        if (part == 0) return std::min(splats, count);
        return std::min(splats, std::max<size_t>(1, size_t(std::llround(double(splats) * part))));
    }
};

Decimation parse_decimation(const std::string& text) {
    Decimation decimation;
    if (text.ends_with('%')) {
        const auto percent =
            core::parse_number(core::trim(std::string_view(text).substr(0, text.size() - 1)));
        if (percent && *percent > 0 && *percent <= 100) decimation.part = *percent / 100;
    } else {
        decimation.count = core::parse_count<size_t>(text).value_or(0);
    }
    if (decimation.part == 0 && decimation.count == 0)
        throw InputError("--decimate: '" + text +
                         "' is neither a number of splats from 1 on nor a percentage above 0 and up to 100");
    return decimation;
}

Edit where(const std::string& value) {
    return {.text = "--where " + value, .filter = parse_filter(value, "--where")};
}

Edit crop(const std::string& value) {
    return {.text = "--crop", .filter = parse_filter("box=" + value, "--crop")};
}

/// A filter without a value.
template <std::vector<bool> (*stay)(const Gaussians&)>
Edit fixed(const char* text) {
    return {.text = text, .filter = [](const Gaussians& g, const Cameras&) { return stay(g); }};
}

Edit transform(const std::string& value) {
    return {.text = "--transform",
            .place = [step = parse_transform({value})](const glm::dmat4& before, auto&) {
                return step * before;
            }};
}

Edit scale_to(const std::string& value) {
    parse_scale_to(value);
    return {.text = "--scale-to", .place = [value](const glm::dmat4& before, auto& remarks) {
                const double factor = parse_scale_to(value, before);
                remarks.push_back(fmt::format("--scale-to: times {:.6g}", factor));
                return glm::scale(glm::dmat4(1.0), glm::dvec3(factor)) * before;
            }};
}

Edit max_sh(const std::string& value) {
    const auto degree = core::parse_count<int>(value);
    if (!degree || *degree < 0 || *degree > kMaxShDegree)
        throw InputError("--max-sh: '" + value + "' is not 0, 1, 2 or 3");
    return {.text = "--max-sh", .change = [degree = *degree](Gaussians& g) {
                if (g.sh_degree > degree) set_sh_degree(g, degree);
            }};
}

Edit decimate(const std::string& value) {
    return {.text = "--decimate", .change = [decimation = parse_decimation(value)](Gaussians& g) {
                decimate_splats(g, decimation.of(g.size()));
            }};
}

Edit sort(const std::string& value) {
    if (value != "morton") throw InputError("--sort: '" + value + "' is not morton");
    return {.text = "--sort", .change = [](Gaussians& g) { select_splats(g, morton_order(g)); }};
}

constexpr std::array kRows{
    Row{"transform", "STEP",
        "Of the joined scene: move=x,y,z, turn=x,y,z,degrees, scale=s, or a matrix of 12 or 16 numbers, row "
        "by "
        "row. Axes are those of a PLY: y down, z forward",
        transform, "move=x,y,z, turn=x,y,z,degrees or scale=s"},
    Row{"scale-to", "x,y,z,X,Y,Z,LENGTH",
        "Scale the joined scene until these two points are LENGTH apart; they are its points before the "
        "--transform that stands right before. ewa-view measures points",
        scale_to},
    Row{"where", "FILTER",
        "Keep only splats that pass the filter: COLUMN=LOW..HIGH, box=x,y,z,X,Y,Z or sphere=x,y,z,radius. "
        "One bound is enough. Columns: x, y, z, opacity, scale (the largest), thickness (the smallest "
        "scale), red, green, blue, and of a training run views: the images in which the centre is",
        where, "Keep only splats of opacity=0.1.., box=..., sphere=... or the like"},
    Row{"crop", "x,y,z,X,Y,Z", "The same as --where box=x,y,z,X,Y,Z", crop, "Keep only splats in this box"},
    Row{"remove-invalid", "", "Remove splats with a value that is not finite, or a zero quaternion",
        [](const std::string&) { return fixed<drawable_splats>("--remove-invalid"); },
        "Remove splats with a value that is not finite"},
    Row{"remove-floaters", "",
        "Remove groups of fewer than 10 splats that touch no others of about their size",
        [](const std::string&) { return fixed<grounded_splats>("--remove-floaters"); },
        "Remove small groups of splats far from others"},
    Row{"largest-cluster", "", "Keep only the largest group of splats that touch others of about their size",
        [](const std::string&) { return fixed<largest_cluster>("--largest-cluster"); }},
    Row{"max-sh", "0..3", "Reduce the spherical harmonics to this degree", max_sh,
        "Reduce the spherical harmonics to this degree"},
    Row{"decimate", "N|P%",
        "Merge near splats until this number of them is left, or this percentage: 500k, 50%", decimate,
        "Merge near splats until N or P% are left"},
    Row{"sort", "ORDER",
        "Order of the splats: morton puts neighbours in space next to each other in the file", sort},
};

/// Steps that are not applied yet.
struct Steps {
    glm::dmat4 matrix{1.0};
    std::vector<std::string> names;

    void add(const Edit& edit, std::vector<std::string>& remarks) {
        matrix = edit.place(matrix, remarks);
        if (std::ranges::find(names, edit.text) == names.end()) names.push_back(edit.text);
    }
    /// Whether they move the splats.
    bool apply(Gaussians& gaussians) {
        const Steps all = std::exchange(*this, {});
        if (all.matrix == glm::dmat4(1.0)) return false;
        std::string what;
        for (const std::string& name : all.names) what += (what.empty() ? "" : " and ") + name;
        place_splats(gaussians, all.matrix, what);
        return true;
    }
};

/// Removes splats. left: their numbers.
void remove_others(Gaussians& gaussians, const std::vector<bool>& stay, std::vector<uint32_t>& left) {
    std::vector<uint32_t> staying, numbers;
    for (size_t i = 0; i < stay.size(); ++i) {
        if (!stay[i]) continue;
        staying.push_back(uint32_t(i));
        if (!left.empty()) numbers.push_back(left[i]);
    }
    left = std::move(numbers);
    if (staying.size() < stay.size()) keep_splats(gaussians, staying);
}

}  // namespace

std::span<const Row> rows() {
    return kRows;
}

Edit parse(std::string_view name, const std::string& value) {
    const auto row = std::ranges::find(kRows, name, [](const Row& r) { return std::string_view(r.name); });
    if (row == kRows.end()) throw InputError("--" + std::string(name) + " is no edit");
    return row->parse(value);
}

Applied apply(Gaussians& gaussians, std::span<const Edit> edits, const Cameras& cameras) {
    Applied applied;
    applied.left.resize(gaussians.size());
    std::iota(applied.left.begin(), applied.left.end(), 0u);
    Steps steps;
    for (const Edit& edit : edits) {
        if (edit.place) {
            steps.add(edit, applied.remarks);
            continue;
        }
        applied.moved = steps.apply(gaussians) || applied.moved;
        const size_t before = gaussians.size();
        if (edit.filter) {
            remove_others(gaussians, edit.filter(gaussians, applied.moved ? Cameras() : cameras),
                          applied.left);
        } else {
            edit.change(gaussians);
            applied.left.clear();
        }
        if (edit.filter || gaussians.size() != before)
            applied.outcomes.push_back({edit.text, bool(edit.filter), before, gaussians.size()});
    }
    applied.moved = steps.apply(gaussians) || applied.moved;
    return applied;
}

}  // namespace ewa::edit
