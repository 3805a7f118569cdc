// SPDX-License-Identifier: Apache-2.0
#include "io/splats/place.h"

#include <array>
#include <charconv>
#include <cmath>
#include <nlohmann/json.hpp>

#include "core/folders.h"
#include "core/json.h"
#include "core/json_field.h"
#include "core/text.h"
#include "core/typing.h"
#include "ewa/error.h"

namespace ewa::io {
namespace {

constexpr std::string_view kComment = "ewa place ";
constexpr const char* kAxes =
    "x east, y down, z north, metres";  // of the world; files of others have other axes

/// Latitude, longitude and height. Empty unless they are on the globe.
std::optional<Place> checked(const std::array<double, 3>& values) {
    const bool valid = std::abs(values[0]) <= 90 && std::abs(values[1]) <= 360 && std::isfinite(values[2]);
    return valid ? std::optional(Place{values[0], values[1], values[2]}) : std::nullopt;
}

std::optional<Place> place_of(std::string_view comment) {
    comment.remove_prefix(kComment.size());
    std::array<double, 3> values{};
    for (double& value : values) value = core::parse_number(core::next_word(comment)).value_or(std::nan(""));
    return checked(values);
}

}  // namespace

std::optional<Place> read_place(const std::filesystem::path& folder) {
    const std::filesystem::path file = folder / kPlaceFile;
    if (!core::is_file(file)) return {};
    nlohmann::json json;
    try {
        json = core::read_json_file<nlohmann::json>(file, {.bytes = 1u << 16});
    } catch (const InputError&) {
        return {};  // another program's
    }
    if (core::text_in(json, "axes") != kAxes) return {};
    const auto value = [&](const char* name) { return core::number_in(json, name).value_or(std::nan("")); };
    return checked({value("latitude"), value("longitude"), value("height")});
}

void write_place(const std::filesystem::path& file, const Place& place) {
    core::write_json(file, {{"axes", kAxes},
                            {"latitude", place.latitude},
                            {"longitude", place.longitude},
                            {"height", place.height}});
}

std::string place_comment(const Place& place) {
    std::string text(kComment);
    for (const double value : {place.latitude, place.longitude, place.height}) {
        std::array<char, 32> digits{};
        text.append(digits.data(), std::to_chars(digits.begin(), digits.end(), value).ptr) += ' ';
    }
    text.pop_back();
    return text;
}

bool is_place_comment(const std::string& comment) {
    return comment.starts_with(kComment);
}

std::optional<Place> place_in(const std::vector<std::string>& comments) {
    std::optional<std::string> first;
    for (const std::string& comment : comments) {
        if (!is_place_comment(comment)) continue;
        if (first && *first != comment) return {};
        first = comment;
    }
    return first ? place_of(*first) : std::nullopt;
}

}  // namespace ewa::io
