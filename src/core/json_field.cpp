// SPDX-License-Identifier: Apache-2.0
#include "core/json_field.h"

#include <cmath>
#include <nlohmann/json.hpp>

#include "core/text.h"
#include "ewa/error.h"

namespace ewa::core {

namespace {

constexpr double kMostPixels = 1 << 20, kMostIndex = 1ull << 53;

std::string quoted(const char* key) {
    return std::string("\"") + key + "\"";
}

/// False if a value is not a finite number, or lists lie in lists in lists.
bool add_numbers(const nlohmann::json& list, int depth, std::vector<double>& numbers) {
    for (const nlohmann::json& value : list) {
        if (value.is_array() && depth == 0) {
            if (!add_numbers(value, 1, numbers)) return false;
        } else if (value.is_number() && std::isfinite(value.get<double>())) {
            numbers.push_back(value.get<double>());
        } else {
            return false;
        }
    }
    return true;
}

}  // namespace

void JsonField::fail(const std::string& text) const {
    throw InputError(one_line(where_ + ": " + text));
}

bool JsonField::has(const char* key) const {
    const auto found = value_->find(key);
    return found != value_->end() && !found->is_null();
}

const nlohmann::json& JsonField::member(const char* key) const {
    if (!has(key)) fail(quoted(key) + " is missing");
    return *value_->find(key);
}

JsonField JsonField::at(const char* key, const std::string& what) const {
    return {member(key), what.empty() ? where_ : where_ + ": " + what};
}

const nlohmann::json& JsonField::list(const char* key) const {
    const nlohmann::json& value = member(key);
    if (!value.is_array()) fail(quoted(key) + " is not a list");
    return value;
}

const nlohmann::json& JsonField::members(const char* key) const {
    const nlohmann::json& value = member(key);
    if (!value.is_object()) fail(quoted(key) + " is not a JSON object");
    return value;
}

JsonField JsonField::object(const char* key) const {
    return {members(key), where_};
}

double JsonField::number(const char* key) const {
    const nlohmann::json& value = member(key);
    if (!value.is_number() || !std::isfinite(value.get<double>()))
        fail(quoted(key) + " is not a finite number");
    return value.get<double>();
}

double JsonField::number(const char* key, double absent) const {
    return has(key) ? number(key) : absent;
}

std::vector<double> JsonField::numbers(const char* key, size_t count) const {
    const nlohmann::json& value = member(key);
    std::vector<double> numbers;
    if (!value.is_array() || value.size() > count || !add_numbers(value, 0, numbers) ||
        numbers.size() != count)
        fail(quoted(key) + " is not a list of " + std::to_string(count) + " finite numbers");
    return numbers;
}

int JsonField::side(const char* key) const {
    const double value = number(key);
    if (!(value >= 1 && value <= kMostPixels) || value != std::floor(value))
        fail(quoted(key) + " is not a whole number of pixels in 1..1048576");
    return static_cast<int>(value);
}

uint64_t JsonField::index(const char* key) const {
    const double value = number(key);
    if (!(value >= 0 && value < kMostIndex) || value != std::floor(value))
        fail(quoted(key) + " is not a whole number");
    return static_cast<uint64_t>(value);
}

std::string JsonField::text(const char* key) const {
    const nlohmann::json& value = member(key);
    if (!value.is_string()) fail(quoted(key) + " is not a string");
    return value.get<std::string>();
}

std::optional<std::vector<double>> three_numbers(const nlohmann::json& value) {
    std::vector<double> numbers;
    if (!value.is_array() || value.size() != 3 || !add_numbers(value, 1, numbers) || numbers.size() != 3)
        return std::nullopt;
    return numbers;
}

}  // namespace ewa::core
