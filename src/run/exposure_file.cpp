// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <nlohmann/json.hpp>

#include "core/json.h"
#include "core/text.h"
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

}  // namespace

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
