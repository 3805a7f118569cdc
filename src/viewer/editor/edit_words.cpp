// SPDX-License-Identifier: Apache-2.0
#include "viewer/editor/edit_words.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cmath>
#include <glm/mat3x3.hpp>
#include <initializer_list>
#include <utility>

#include "core/typing.h"
#include "edit/steps.h"

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

/// The edits of adjustments that have an effect.
std::vector<edit::Words> adjust(std::initializer_list<edit::Adjustment> adjustments) {
    std::vector<edit::Words> edits;
    for (const edit::Adjustment& adjustment : adjustments)
        if (std::string text = adjustment_text(adjustment); !text.empty())
            edits.push_back({"adjust", std::move(text)});
    return edits;
}

}  // namespace

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
    if (red == green && green == blue) {
        const double factor = double(red) * after.factor / before.factor;
        change.tint.fill(float(factor));
        change.brightness = float(after.offset - factor * before.offset);
        return adjust({change});
    }
    // Offsets would differ between the channels: back to no tone, then to the new one.
    edit::Adjustment back;
    back.tint.fill(float(1 / before.factor));
    back.brightness = float(-before.offset / before.factor);
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
