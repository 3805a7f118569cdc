// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <nlohmann/json.hpp>
#include <utility>
#include <variant>
#include <vector>

#include "core/json.h"
#include "core/text.h"
#include "core/typing.h"
#include "ewa/appearance.h"
#include "ewa/error.h"
#include "ewa/exposure.h"

namespace ewa {
namespace {

using nlohmann::json;

bool is_list(const json& value, size_t size) {
    return value.is_array() && value.size() == size;
}

Exposure exposure_of(const json& rows, const std::string& where) {
    const auto wrong = [&] {
        return InputError(where + ": an exposure is three rows of four finite numbers");
    };
    if (!is_list(rows, 3)) throw wrong();
    Exposure exposure;
    for (size_t row = 0; row < 3; ++row) {
        if (!is_list(rows[row], 4)) throw wrong();
        for (size_t column = 0; column < 4; ++column) {
            const json& value = rows[row][column];
            const float number = value.is_number() ? value.get<float>() : NAN;
            if (!std::isfinite(number)) throw wrong();
            exposure[4 * row + column] = number;
        }
    }
    return exposure;
}

/// `count` finite numbers.
void read_numbers(const json& values, size_t count, float* into, const std::string& where) {
    bool right = is_list(values, count);
    for (size_t k = 0; right && k < count; ++k) {
        into[k] = values[k].is_number() ? values[k].get<float>() : NAN;
        right = std::isfinite(into[k]);
    }
    if (!right) throw InputError(where + ": expected " + std::to_string(count) + " finite numbers");
}

Appearance grid_of(const json& image, const std::string& where) {
    ColorGrid grid;
    read_numbers(image, grid.cells.size(), grid.cells.data(), where);
    return grid;
}

Appearance ppisp_of(const json& image, const json& cameras, const std::string& where) {
    Ppisp ppisp;
    if (!image.is_object()) throw InputError(where + ": expected \"camera\" and \"photo\"");
    const auto camera = image.find("camera"), photo = image.find("photo");
    if (camera == image.end() || !camera->is_number_unsigned() || camera->get<uint64_t>() >= cameras.size())
        throw InputError(where + ": \"camera\" is not a number of one of the cameras");
    if (photo == image.end()) throw InputError(where + ": \"photo\" is missing");
    read_numbers(*photo, ppisp.photo.size(), ppisp.photo.data(), where + ": \"photo\"");
    read_numbers(cameras[camera->get<size_t>()], ppisp.camera.size(), ppisp.camera.data(),
                 where + ": its camera");
    return ppisp;
}

}  // namespace

std::map<std::string, Appearance> load_appearances(const std::filesystem::path& path) {
    const auto all = core::read_json_file<json>(path);
    const std::string file = core::one_line(path.string());
    std::map<std::string, Appearance> appearances;
    const auto model = all.is_object() ? all.find("model") : all.end();
    if (!all.is_object() || model == all.end() || !model->is_string()) {
        for (const auto& [name, exposure] : load_exposures(path)) appearances[name] = exposure;
        return appearances;
    }
    const bool grid = *model == "grid";
    if (!grid && *model != "ppisp") throw InputError(file + ": \"model\" is neither \"ppisp\" nor \"grid\"");
    const auto images = all.find("images"), cameras = all.find("cameras");
    if (images == all.end() || !images->is_object()) throw InputError(file + ": \"images\" is not an object");
    if (!grid && (cameras == all.end() || !cameras->is_array()))
        throw InputError(file + ": \"cameras\" is not an array");
    for (const auto& [name, image] : images->items()) {
        const std::string where = file + ": \"" + core::one_line(name) + "\"";
        appearances[name] = grid ? grid_of(image, where) : ppisp_of(image, *cameras, where);
    }
    return appearances;
}

void save_appearances(const std::filesystem::path& path, const std::vector<std::string>& names,
                      const std::vector<Appearance>& appearances) {
    check(appearances);
    if (names.size() != appearances.size())
        throw InputError(core::counted(names.size(), "name") + " for " +
                         core::counted(appearances.size(), "appearance"));
    if (!appearances.empty() && std::holds_alternative<Exposure>(appearances.front()))
        throw InputError("exposures are no appearance.json");
    nlohmann::ordered_json all;
    const bool grid = !appearances.empty() && std::holds_alternative<ColorGrid>(appearances.front());
    all["model"] = grid ? "grid" : "ppisp";
    std::vector<std::array<float, 27>> cameras;
    auto images = nlohmann::ordered_json::object();
    for (size_t i = 0; i < appearances.size(); ++i) {
        if (grid) {
            images[names[i]] = std::get<ColorGrid>(appearances[i]).cells;
            continue;
        }
        const Ppisp& ppisp = std::get<Ppisp>(appearances[i]);
        const auto camera = std::ranges::find(cameras, ppisp.camera);
        images[names[i]] = {{"camera", camera - cameras.begin()}, {"photo", ppisp.photo}};
        if (camera == cameras.end()) cameras.push_back(ppisp.camera);
    }
    if (!grid) all["cameras"] = cameras;
    all["images"] = std::move(images);
    core::write_json(path, all);
}

std::map<std::string, Exposure> load_exposures(const std::filesystem::path& path) {
    const auto all = core::read_json_file<json>(path);
    const std::string file = core::one_line(path.string());
    if (!all.is_object()) throw InputError(file + ": the JSON is not an object of exposures");
    std::map<std::string, Exposure> exposures;
    for (const auto& [name, rows] : all.items())
        exposures[name] = exposure_of(rows, file + ": \"" + core::one_line(name) + "\"");
    return exposures;
}

}  // namespace ewa
