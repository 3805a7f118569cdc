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

/// An older run's exposures.json: three rows for each image.
std::map<std::string, Appearance> read_exposures(const json& all, const std::string& file) {
    if (!all.is_object()) throw InputError(file + ": the JSON is not an object of appearances");
    std::map<std::string, Appearance> exposures;
    for (const auto& [name, rows] : all.items())
        exposures[name] = exposure_of(rows, file + ": \"" + core::one_line(name) + "\"");
    return exposures;
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

Appearance affine_of(const json& image, const std::string& where) {
    Exposure exposure;
    read_numbers(image, exposure.size(), exposure.data(), where);
    return exposure;
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

enum : size_t { kAffine, kPpisp, kGrid };  // as in Appearance
constexpr std::array<const char*, 3> kModels{"affine", "ppisp", "grid"};

}  // namespace

std::map<std::string, Appearance> load_appearances(const std::filesystem::path& path) {
    const auto all = core::read_json_file<json>(path);
    const std::string file = core::one_line(path.string());
    std::map<std::string, Appearance> appearances;
    const auto word = all.is_object() ? all.find("model") : all.end();
    if (!all.is_object() || word == all.end() || !word->is_string()) return read_exposures(all, file);
    const auto model = size_t(std::ranges::find(kModels, word->get<std::string>()) - kModels.begin());
    if (model == kModels.size())
        throw InputError(file + ": \"model\" is none of \"affine\", \"ppisp\" and \"grid\"");
    const auto images = all.find("images"), cameras = all.find("cameras");
    if (images == all.end() || !images->is_object()) throw InputError(file + ": \"images\" is not an object");
    if (model == kPpisp && (cameras == all.end() || !cameras->is_array()))
        throw InputError(file + ": \"cameras\" is not an array");
    for (const auto& [name, image] : images->items()) {
        const std::string where = file + ": \"" + core::one_line(name) + "\"";
        appearances[name] = model == kAffine ? affine_of(image, where)
                            : model == kGrid ? grid_of(image, where)
                                             : ppisp_of(image, *cameras, where);
    }
    return appearances;
}

void save_appearances(const std::filesystem::path& path, const std::vector<std::string>& names,
                      const std::vector<Appearance>& appearances) {
    check(appearances);
    if (names.size() != appearances.size())
        throw InputError(core::counted(names.size(), "name") + " for " +
                         core::counted(appearances.size(), "appearance"));
    nlohmann::ordered_json all;
    all["model"] = kModels[appearances.empty() ? size_t(kPpisp) : appearances.front().index()];
    std::vector<std::array<float, 27>> cameras;
    auto images = nlohmann::ordered_json::object();
    for (size_t i = 0; i < appearances.size(); ++i) {
        auto& image = images[names[i]];
        if (const auto* exposure = std::get_if<Exposure>(&appearances[i])) image = *exposure;
        if (const auto* grid = std::get_if<ColorGrid>(&appearances[i])) image = grid->cells;
        const auto* ppisp = std::get_if<Ppisp>(&appearances[i]);
        if (!ppisp) continue;
        const auto camera = std::ranges::find(cameras, ppisp->camera);
        image = {{"camera", camera - cameras.begin()}, {"photo", ppisp->photo}};
        if (camera == cameras.end()) cameras.push_back(ppisp->camera);
    }
    if (all["model"] == "ppisp") all["cameras"] = cameras;
    all["images"] = std::move(images);
    core::write_json(path, all);
}

}  // namespace ewa
