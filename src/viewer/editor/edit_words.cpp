// SPDX-License-Identifier: Apache-2.0
#include "viewer/editor/edit_words.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cmath>
#include <glm/mat3x3.hpp>
#include <initializer_list>
#include <iterator>
#include <utility>

#include "core/text.h"
#include "core/typing.h"
#include "edit/steps.h"
#include "viewer/editor/texts.h"

namespace ewa::viewer {
namespace {

/// What follows the tint: the same factor and offset for all channels.
struct Tone {
    double factor, offset;
};

Tone tone_of(const edit::Adjustment& a) {
    const double contrast = double(a.contrast), white = double(a.white);
    return {contrast / white, ((double(a.brightness) - 0.5) * contrast + 0.5) / white};
}

/// Whether "x,y,x,y,..." before a semicolon are the corners of a rectangle.
bool is_rectangle(std::string_view text) {
    const auto n = core::parse_list(text.substr(0, text.find(';')));
    if (!n || n->size() != 8) return false;
    const std::vector<double>& at = *n;
    return at[1] == at[3] && at[2] == at[4] && at[5] == at[7] && at[6] == at[0];
}

/// The white point that brings all values of tone_step() into the ranges of --adjust.
double white_for(double factor, double offset) {
    constexpr double kMostTint = 1000;
    return 1 / std::max({1.0, std::abs(offset), factor / kMostTint});
}
constexpr double kLeastWhite = 0.01;

/// Multiplies all channels by a factor, then adds the offset.
edit::Adjustment tone_step(double factor, double offset) {
    const double white = white_for(factor, offset);
    edit::Adjustment result{.brightness = float(offset * white), .white = float(white)};
    result.tint.fill(float(factor * white));
    return result;
}

/// The edits of adjustments that have an effect.
std::vector<edit::Words> adjust(std::initializer_list<edit::Adjustment> adjustments) {
    std::vector<edit::Words> edits;
    for (const edit::Adjustment& adjustment : adjustments)
        if (std::string text = adjustment_text(adjustment); !text.empty())
            edits.push_back({"adjust", std::move(text)});
    return edits;
}

}  // namespace

std::string selection_title(std::string_view shape) {
    namespace say = texts::edit_panel;
    std::string_view verb = say::kSelect.name;
    for (size_t i = 1; i < std::size(edit::kOperationWords); ++i) {
        if (!shape.starts_with(edit::kOperationWords[i])) continue;
        shape.remove_prefix(edit::kOperationWords[i].size());
        verb = say::kOperations[i].name;
    }
    const std::string_view name = shape.substr(0, shape.find('='));
    for (const texts::Item& item : {say::kInvert, say::kGrow, say::kShrink})
        if (name == item.value) return item.name;
    if (name == shape) return fmt::format("{} {}", verb, name);
    const bool rectangle = name == "polygon" && is_rectangle(shape.substr(name.size() + 1));
    return fmt::format(say::kByShape, verb, rectangle ? say::kRectangle : name);
}

std::string edit_news(const EditSnapshot& before, const EditSnapshot& now) {
    const bool undone = now.done < before.done;
    const size_t row = undone ? now.done : now.done - 1, all = now.steps.size();
    if (row >= all) return "";
    const bool redone = before.done < std::min(before.steps.size(), now.done) &&
                        before.steps[before.done] == now.steps[before.done];
    std::string text = undone ? texts::kUndone : redone ? texts::kRedone : "";
    const size_t steps = undone ? before.done - now.done : now.done - before.done;
    text += text.empty() || steps == 1 ? now.steps[row].title : core::grouped(steps, "edit");
    // What the step has changed; else what is selected, or what a move without a selection takes.
    size_t splats = now.selected;
    if (splats == 0 && now.values_version != before.values_version)
        splats = now.left - now.locked - now.hidden;
    for (const auto count : {&EditSnapshot::hidden, &EditSnapshot::locked, &EditSnapshot::left})
        if (now.*count != before.*count)
            splats = std::max(now.*count, before.*count) - std::min(now.*count, before.*count);
    return fmt::format("{}, {}, {:.0f} ms", text, core::grouped(splats, "splat"), now.milliseconds);
}

std::string broken_lines(std::string_view text, size_t most) {
    std::string lines;
    for (size_t used = 0; !text.empty();) {
        const size_t end = std::min(text.find_first_of(" ,;"), text.size() - 1) + 1;
        if (used > 0 && used + end > most) {
            lines += '\n';
            used = 0;
        }
        lines += text.substr(0, end);
        used += end;
        text.remove_prefix(end);
    }
    return lines;
}

std::string part_text(size_t count, size_t of) {
    constexpr double kLeastPercent = 0.001;
    const double percent = of > 0 ? 100.0 * double(count) / double(of) : 0;
    const bool less = percent > 0 && percent < kLeastPercent;
    return fmt::format(texts::edit_panel::kPart, core::grouped(count, "splat"), less ? "< " : "",
                       less ? kLeastPercent : percent);
}

bool has_key(std::string_view keys, int key, bool shift, bool control) {
    constexpr std::pair<std::string_view, int> kNames[] = {{"Esc", 256}, {"Backspace", 259}, {"Del", 261}};
    constexpr std::string_view kOr = " or ";
    for (size_t end = 0; !keys.empty(); keys.remove_prefix(std::min(keys.size(), end + kOr.size()))) {
        end = std::min(keys.find(kOr), keys.size());
        std::string_view name = keys.substr(0, end);
        const auto take = [&](std::string_view modifier) {
            const bool there = name.starts_with(modifier);
            if (there) name.remove_prefix(modifier.size());
            return there;
        };
        const bool with_control = take("Ctrl+"), with_shift = take("Shift+");
        const bool free = name == "=" || name == "-";
        if (with_control != control || (with_shift != shift && !free)) continue;
        const auto* named = std::ranges::find(kNames, name, &std::pair<std::string_view, int>::first);
        // The number of another key is its character.
        if (key == (named != std::end(kNames) ? named->second : int(name.front()))) return true;
    }
    return false;
}

std::string adjustment_text(const edit::Adjustment& adjustment) {
    const edit::Adjustment none;
    std::string text;
    const auto add = [&](const std::string& part) { text += (text.empty() ? "" : ";") + part; };
    const auto& [red, green, blue] = adjustment.tint;
    if (adjustment.tint != none.tint) add(fmt::format("tint={},{},{}", red, green, blue));
    if (adjustment.brightness != none.brightness) add(fmt::format("brightness={}", adjustment.brightness));
    if (adjustment.contrast != none.contrast) add(fmt::format("contrast={}", adjustment.contrast));
    if (adjustment.white != none.white) add(fmt::format("white={}", adjustment.white));
    if (adjustment.opacity != none.opacity) add(fmt::format("opacity={}", adjustment.opacity));
    return text;
}

std::vector<edit::Words> adjustment_edits(const edit::Adjustment& from, const edit::Adjustment& to) {
    if (from == to) return {};
    const Tone before = tone_of(from), after = tone_of(to);
    edit::Adjustment change;
    change.opacity = to.opacity / from.opacity;
    for (size_t c = 0; c < 3; ++c) change.tint[c] = to.tint[c] / from.tint[c];
    if (before.factor == 1 && before.offset == 0) {
        change.brightness = to.brightness;
        change.contrast = to.contrast;
        change.white = to.white;
        return adjust({change});
    }
    const auto& [red, green, blue] = change.tint;
    const double factor = double(red) * after.factor / before.factor;
    const double offset = after.offset - factor * before.offset;
    if (red == green && green == blue && white_for(factor, offset) >= kLeastWhite) {
        edit::Adjustment both = tone_step(factor, offset);
        both.opacity = change.opacity;
        return adjust({both});
    }
    // Offsets would differ between the channels: back to no tone, then to the new one.
    const edit::Adjustment back = tone_step(1 / before.factor, -before.offset / before.factor);
    change.brightness = to.brightness;
    change.contrast = to.contrast;
    change.white = to.white;
    return adjust({back, change});
}

std::string placement_text(const glm::dvec3& about, const Placement& placement) {
    const glm::dvec3 way = placement.position - about;
    if (placement.degrees == glm::dvec3(0) && placement.scale == 1)
        return way == glm::dvec3(0) ? "" : fmt::format("move={:.9g},{:.9g},{:.9g}", way.x, way.y, way.z);
    const glm::dvec3& degrees = placement.degrees;
    const glm::dmat3 linear(edit::parse_transform(
        {fmt::format("turn=1,0,0,{}", degrees.x), fmt::format("turn=0,1,0,{}", degrees.y),
         fmt::format("turn=0,0,1,{}", degrees.z), fmt::format("scale={}", placement.scale)}));
    const glm::dvec3 offset = placement.position - linear * about;
    std::string text;
    for (int row = 0; row < 3; ++row)
        text += fmt::format("{}{:.12g},{:.12g},{:.12g},{:.12g}", row == 0 ? "" : ",", linear[0][row],
                            linear[1][row], linear[2][row], offset[row]);
    return text;
}

bool paste_shape(const std::string& text, EditSettings& settings) {
    const size_t equals = text.find('=');
    if (equals == std::string::npos) return false;
    const std::string name(core::trim(std::string_view(text).substr(0, equals)));
    const std::string numbers(core::trim(std::string_view(text).substr(equals + 1)));
    if (name == "box") {
        const auto box = core::parse_box(numbers);
        if (!box) return false;
        settings.box_low = {(*box)[0], (*box)[1], (*box)[2]};
        settings.box_high = {(*box)[3], (*box)[4], (*box)[5]};
        return true;
    }
    const auto sphere = core::parse_list(numbers);
    if (name != "sphere" || !sphere || sphere->size() != 4 || sphere->back() <= 0) return false;
    settings.sphere_center = {(*sphere)[0], (*sphere)[1], (*sphere)[2]};
    settings.sphere_radius = sphere->back();
    return true;
}

}  // namespace ewa::viewer
