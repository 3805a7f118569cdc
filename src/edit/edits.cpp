// SPDX-License-Identifier: Apache-2.0
#include "edit/edits.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/gtc/matrix_transform.hpp>
#include <numeric>
#include <optional>
#include <utility>

#include "core/text.h"
#include "core/typing.h"
#include "edit/edited_splats.h"
#include "edit/ground.h"
#include "edit/shapes.h"
#include "edit/steps.h"
#include "ewa/error.h"
#include "ewa/splat_edit.h"
#include "scene/framing.h"

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

Edit remove_contradicted(const std::string&) {
    return {.text = "--remove-contradicted", .filter = [](const Gaussians& g, const Cameras& cameras) {
                std::vector<uint32_t> all(g.size());
                std::iota(all.begin(), all.end(), 0u);
                std::vector<bool> flags = contradicted_splats(g, all, cameras, "--remove-contradicted");
                flags.flip();
                return flags;
            }};
}

void level_by_ground(EditedSplats& splats) {
    const glm::dvec3 up = scene::guessed_up(*splats.splats());
    const auto matrix = level_ground(*splats.splats(), splats.states(), up);
    if (!matrix)
        throw InputError(
            "--transform: level=ground finds no ground: no plane below the scene has a tenth of its splats");
    splats.change(*matrix, true);
}

Edit transform(const std::string& value) {
    const bool all = value.starts_with(kAllSplats);
    if (value == "level=ground") return {.text = "--transform", .act = level_by_ground, .all = true};
    return {.text = "--transform",
            .place = [step = parse_transform({all ? value.substr(kAllSplats.size()) : value})](
                         const glm::dmat4& before, auto&) { return step * before; },
            .all = all};
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

constexpr double kLeastFactor = 1e-6, kMostFactor = 1000;  // of an adjustment

Edit select_shape(const std::string& value) {
    return {.text = "--select " + value,
            .act = [selection = parse_selection(value)](EditedSplats& splats) { select(splats, selection); }};
}

Edit remove_shape(const std::string& value) {
    return {.text = "--remove", .act = [shape = parse_shape(value, "--remove")](EditedSplats& splats) {
                delete_shape(splats, shape);
            }};
}

/// Sets and clears bits of the states of the affected splats.
template <uint8_t set, uint8_t cleared>
Edit mark_selected(const char* text) {
    return {.text = text, .act = [](EditedSplats& splats) {
                std::vector<uint8_t> states = splats.states();
                for (size_t i = 0; i < states.size(); ++i)
                    if (splats.affected(i)) states[i] = uint8_t((states[i] | set) & ~cleared);
                splats.set_states(std::move(states));
            }};
}

template <uint8_t cleared>
Edit unmark_all(const char* text) {
    return {.text = text, .act = [](EditedSplats& splats) {
                std::vector<uint8_t> states = splats.states();
                for (uint8_t& state : states) state &= uint8_t(~cleared);
                splats.set_states(std::move(states));
            }};
}

Edit duplicate(const std::string&) {
    return {.text = "--duplicate", .act = [](EditedSplats& splats) { splats.duplicate(); }};
}

Edit reset(const std::string&) {
    return {.text = "--reset", .act = [](EditedSplats& splats) { splats.change(Reset()); }};
}

/// text: steps of Adjustment, such as "tint=1,0.9,0.8;opacity=0.5".
Adjustment parse_adjustment(const std::string& text) {
    Adjustment a;
    const auto refuse = [&] {
        throw InputError(
            "--adjust: '" + text +
            "' is not tint=r,g,b, brightness=x, contrast=x, white=x or opacity=x, or several of "
            "them with ; between; tint is from 0 to 1000, brightness from -1 to 1, other factors "
            "from 0.000001 to 1000");
    };
    for (const std::string_view step : core::split_list(text, ';')) {
        const size_t equals = std::min(step.find('='), step.size());
        const std::string_view name = step.substr(0, equals);
        const auto n = core::parse_list(equals < step.size() ? step.substr(equals + 1) : "");
        const auto factor = [&](float& member) {
            if (!n || n->size() != 1 || n->front() < kLeastFactor || n->front() > kMostFactor) refuse();
            member = float(n->front());
        };
        if (name == "tint" && n && n->size() == 3) {
            for (size_t c = 0; c < 3; ++c) {
                a.tint[c] = float((*n)[c]);
                if (!(a.tint[c] >= 0 && (*n)[c] <= kMostFactor)) refuse();
            }
        } else if (name == "brightness" && n && n->size() == 1 && std::abs(n->front()) <= 1) {
            a.brightness = float(n->front());
        } else if (name == "contrast") {
            factor(a.contrast);
        } else if (name == "white") {
            factor(a.white);
        } else if (name == "opacity") {
            factor(a.opacity);
        } else {
            refuse();
        }
    }
    return a;
}

Edit adjust(const std::string& value) {
    return {.text = "--adjust", .act = [adjustment = parse_adjustment(value)](EditedSplats& splats) {
                splats.change(adjustment);
            }};
}

constexpr std::array kRows{
    Row{"transform", "STEP",
        "Of the joined scene: move=x,y,z, turn=x,y,z,degrees, scale=s, level=ground (the lowest plane), or a "
        "matrix of 12 or 16 numbers, row "
        "by row. Axes are those of a PLY: y down, z forward. After --select, all: before it moves every "
        "splat, also locked and hidden ones",
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
    Row{"remove-contradicted", "",
        "Of a training run: remove splats without which renders are closer to its training images",
        remove_contradicted, "Remove splats that the photos of a run contradict"},
    Row{"largest-cluster", "", "Keep only the largest group of splats that touch others of about their size",
        [](const std::string&) { return fixed<largest_cluster>("--largest-cluster"); }},
    Row{"max-sh", "0..3", "Reduce the spherical harmonics to this degree", max_sh,
        "Reduce the spherical harmonics to this degree"},
    Row{"decimate", "N|P%",
        "Merge near splats until this number of them is left, or this percentage: 500k, 50%", decimate,
        "Merge near splats until N or P% are left"},
    Row{"sort", "ORDER",
        "Order of the splats: morton puts neighbours in space next to each other in the file", sort},
    Row{"select", "SHAPE",
        "Select splats; --transform and the options from here on then change these alone. SHAPE: a FILTER of "
        "--where, "
        "all, none, invert, color=r,g,b,T, flood=x,y,z,T[,opacity], cluster=x,y,z, floaters, far, "
        "contradicted, "
        "grow=R, "
        "shrink=R, splats=0,3,7-9, or "
        "a polygon or "
        "brush in a view, as ewa-view writes it. add:, remove: or and: before it combines it with the "
        "selection",
        select_shape},
    Row{"delete", "", "Delete the selected splats",
        [](const std::string&) { return mark_selected<kDeleted, kSelected>("--delete"); }},
    Row{"remove", "SHAPE", "Delete the splats of a SHAPE of --select. The selection stays", remove_shape},
    Row{"duplicate", "", "Copy the selected splats, and select the copies", duplicate},
    Row{"adjust", "STEP",
        "Change the colours and opacities of the selected splats: tint=r,g,b (factors), brightness=x "
        "(added), contrast=x, "
        "white=x (what becomes white), opacity=x (a factor); several with ; between",
        adjust},
    Row{"reset", "", "Give the selected splats the values of the file back", reset},
    Row{"lock", "", "Keep the selected splats from later selections and edits",
        [](const std::string&) { return mark_selected<kLocked, kSelected>("--lock"); }},
    Row{"unlock", "", "End every --lock", [](const std::string&) { return unmark_all<kLocked>("--unlock"); }},
    Row{"hide", "", "As --lock; ewa-view does not draw them either",
        [](const std::string&) { return mark_selected<kHidden, kSelected>("--hide"); }},
    Row{"unhide", "", "End every --hide", [](const std::string&) { return unmark_all<kHidden>("--unhide"); }},
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

/// The state of apply().
class Chain {
  public:
    Chain(Gaussians& gaussians, const Cameras& cameras) : gaussians_(gaussians), cameras_(cameras) {
        applied_.left.resize(gaussians.size());
        std::iota(applied_.left.begin(), applied_.left.end(), 0u);
    }

    void perform(const Edit& edit) {
        if (edit.act || (edit.place && (selection_ || edit.all))) return act(edit);
        if (edit.place) return steps_.add(edit, applied_.remarks);
        end_selection();
        place();
        const size_t before = gaussians_.size();
        if (edit.filter) {
            keep(edit.filter(gaussians_, applied_.moved ? Cameras() : cameras_));
        } else {
            edit.change(gaussians_);
            applied_.left.assign(gaussians_.size(), kNew);
        }
        if (edit.filter || gaussians_.size() != before)
            applied_.outcomes.push_back({edit.text, bool(edit.filter), before, gaussians_.size()});
    }

    Applied finish() {
        end_selection();
        place();
        std::erase(applied_.left, kNew);
        return std::move(applied_);
    }

  private:
    static constexpr size_t kShown = 120;         // bytes of an edit in a warning
    static constexpr uint32_t kNew = UINT32_MAX;  // of Applied::left: no splat of the first scene

    void act(const Edit& edit) {
        place();
        if (!selection_)
            selection_.emplace(std::make_shared<const Gaussians>(std::move(gaussians_)),
                               applied_.moved ? Cameras() : cameras_);
        EditedSplats& splats = *selection_;
        const size_t before = splats.left();
        const bool selects = edit.text.starts_with("--select ");
        const bool none = edit.text != "--remove" && splats.count(kSelected) == 0;
        acted_ = acted_ || (edit.act && !edit.all);
        Edit now = edit;
        now.all = edit.all || !acted_;  // without --select, each place edit moves the scene
        perform_on(splats, now);
        if (none && !now.all && !selects && !edit.text.starts_with("--un"))
            applied_.warnings.push_back(edit.text + " changed nothing: no splat is selected");
        if (selects && splats.count(kSelected) == 0 && edit.text != "--select none")
            applied_.warnings.push_back(edit.text.substr(0, kShown) + " selects no splat");
        if (splats.left() != before)
            applied_.outcomes.push_back({edit.text, splats.left() < before, before, splats.left()});
        applied_.left.resize(splats.size(), kNew);
        applied_.moved = applied_.moved || edit.place || edit.all;
    }

    void end_selection() {
        if (!selection_) return;
        std::vector<uint32_t> left;
        for (size_t i = 0; i < applied_.left.size(); ++i)
            if ((selection_->states()[i] & kDeleted) == 0) left.push_back(applied_.left[i]);
        applied_.left = std::move(left);
        gaussians_ = selection_->result();
        selection_.reset();
        acted_ = false;
    }

    void place() { applied_.moved = steps_.apply(gaussians_) || applied_.moved; }

    void keep(const std::vector<bool>& stay) {
        std::vector<uint32_t> staying, numbers;
        for (size_t i = 0; i < stay.size(); ++i) {
            if (!stay[i]) continue;
            staying.push_back(uint32_t(i));
            numbers.push_back(applied_.left[i]);
        }
        applied_.left = std::move(numbers);
        if (staying.size() < stay.size()) keep_splats(gaussians_, staying);
    }

    Gaussians& gaussians_;  // empty while there is a selection
    const Cameras& cameras_;
    Applied applied_;
    Steps steps_;
    std::optional<EditedSplats> selection_;
    bool acted_ = false;  // an edit has selected splats since selection_ began
};

}  // namespace

std::span<const Row> rows() {
    return kRows;
}

Edit parse(std::string_view name, const std::string& value) {
    const auto row = std::ranges::find(kRows, name, [](const Row& r) { return std::string_view(r.name); });
    if (row == kRows.end()) throw InputError("--" + std::string(name) + " is no edit");
    return row->parse(value);
}

bool changes_states(std::string_view name) {
    return name == "select" || name == "delete" || name == "remove" || name.ends_with("lock") ||
           name.ends_with("hide");
}

void perform_on(EditedSplats& splats, const Edit& edit) {
    if (edit.act) return edit.act(splats);
    std::vector<std::string> remarks;
    splats.change(edit.place(glm::dmat4(1.0), remarks), edit.all);
}

Applied apply(Gaussians& gaussians, std::span<const Edit> edits, const Cameras& cameras) {
    Chain chain(gaussians, cameras);
    for (const Edit& edit : edits) chain.perform(edit);
    return chain.finish();
}

}  // namespace ewa::edit
