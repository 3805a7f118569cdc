// SPDX-License-Identifier: Apache-2.0
#include "core/json_field.h"

#include <cmath>
#include <nlohmann/json.hpp>

#include "core/text.h"
#include "ewa/error.h"

namespace ewa::core {

namespace {

constexpr uint64_t kMostPixels = 1 << 20;

std::string quoted(const char* key) {
    return std::string("\"") + key + "\"";
}

template <class Json>
bool is_finite(const Json& value) {
    return value.is_number() && std::isfinite(value.template get<double>());
}

/// False unless the value is a list of finite numbers, or of equally long lists of them.
bool add_numbers(const nlohmann::json& list, size_t most, std::vector<double>& numbers) {
    if (!list.is_array() || list.size() > most) return false;
    const bool rows = !list.empty() && list[0].is_array();
    for (const nlohmann::json& value : list) {
        if (rows) {
            if (!value.is_array() || value.size() != list[0].size() || value.empty() || value[0].is_array() ||
                !add_numbers(value, most - numbers.size(), numbers))
                return false;
        } else {
            if (!is_finite(value)) return false;
            numbers.push_back(value.get<double>());
        }
    }
    return true;
}

}  // namespace

JsonField JsonField::of_file(const std::filesystem::path& file, const JsonLimits& limits,
                             std::string advice) {
    const auto whole = std::make_shared<const nlohmann::json>(read_json_file<nlohmann::json>(file, limits));
    JsonField field(*whole, one_line(file.string()), std::move(advice));
    field.whole_ = whole;
    return field;
}

JsonField JsonField::of_text(std::string_view text, const std::string& name, const JsonLimits& limits,
                             std::string advice) {
    const auto whole = std::make_shared<const nlohmann::json>(parse_json<nlohmann::json>(text, name, limits));
    JsonField field(*whole, name, std::move(advice));
    field.whole_ = whole;
    return field;
}

void JsonField::fail(const std::string& text) const {
    throw InputError(one_line(where_ + ": " + text));
}

void JsonField::fail(const char* key, const std::string& expected) const {
    fail((key ? quoted(key) + " " : std::string()) + "is not " + expected);
}

JsonField JsonField::or_of(const nlohmann::json& other) const {
    JsonField both = *this;
    both.other_ = &other;
    return both;
}

bool JsonField::has(const char* key) const {
    const auto found = value_->find(key);
    if (found != value_->end() && !found->is_null()) return true;
    return other_ && other_->contains(key) && !other_->find(key)->is_null();
}

const nlohmann::json& JsonField::member(const char* key) const {
    if (!key) return *value_;
    if (!value_->is_object()) fail("is not a JSON object with " + quoted(key) + advice_);
    if (!has(key)) fail(quoted(key) + " is missing" + advice_);
    const auto found = value_->find(key);
    return found != value_->end() && !found->is_null() ? *found : *other_->find(key);
}

JsonField JsonField::at(const char* key, const std::string& what) const {
    return {member(key), what.empty() ? where_ : where_ + ": " + what, advice_};
}

const nlohmann::json& JsonField::list(const char* key) const {
    const nlohmann::json& value = member(key);
    if (!value.is_array()) fail(key, "a list");
    return value;
}

const nlohmann::json& JsonField::members(const char* key) const {
    const nlohmann::json& value = member(key);
    if (!value.is_object()) fail(key, "a JSON object");
    return value;
}

JsonField JsonField::object(const char* key) const {
    return {members(key), where_, advice_};
}

JsonField JsonField::part(const char* key) const {
    return {members(key), where_ + ": " + quoted(key), advice_};
}

std::vector<JsonField> JsonField::items(const char* key) const {
    std::vector<JsonField> fields;
    for (const nlohmann::json& value : list(key))
        fields.emplace_back(value, where_ + ": " + quoted(key) + " " + std::to_string(fields.size()),
                            advice_);
    return fields;
}

double JsonField::number(const char* key) const {
    const nlohmann::json& value = member(key);
    if (!is_finite(value)) fail(key, "a finite number");
    return value.get<double>();
}

double JsonField::number(const char* key, double absent) const {
    return has(key) ? number(key) : absent;
}

std::optional<double> JsonField::number_if(const char* key) const {
    return has(key) ? std::optional(number(key)) : std::nullopt;
}

std::vector<double> JsonField::numbers(const char* key, size_t least, size_t most, const char* form) const {
    std::vector<double> numbers;
    if (add_numbers(member(key), most, numbers) && numbers.size() >= least && numbers.size() <= most)
        return numbers;
    const std::string range = least < most ? std::to_string(least) + " to " : std::string();
    fail(key, form ? form : "a list of " + range + std::to_string(most) + " finite numbers");
}

std::vector<float> JsonField::floats(const char* key, size_t count, const char* form) const {
    std::vector<float> values;
    for (const double number : numbers(key, count, count, form)) {
        values.push_back(float(number));
        if (!std::isfinite(values.back())) fail(key, form ? form : "a list of numbers that float32 has");
    }
    return values;
}

uint64_t JsonField::whole(const char* key, uint64_t most, uint64_t least) const {
    constexpr double kLimit = 1ull << 53;
    const nlohmann::json& value = member(key);
    const double number = is_finite(value) ? value.get<double>() : -1;
    if (number >= 0 && number < kLimit && number == std::floor(number) && uint64_t(number) >= least &&
        uint64_t(number) <= most)
        return uint64_t(number);
    fail(key, "a whole number of " + std::to_string(least) + " to " + std::to_string(most));
}

int JsonField::side(const char* key) const {
    return int(whole(key, kMostPixels, 1));
}

const std::string& JsonField::text(const char* key) const {
    const nlohmann::json& value = member(key);
    if (!value.is_string()) fail(key, "a string");
    return value.get_ref<const std::string&>();
}

std::string JsonField::text(const char* key, const std::string& absent) const {
    return has(key) ? text(key) : absent;
}

bool JsonField::flag(const char* key) const {
    if (!has(key)) return false;
    const nlohmann::json& value = member(key);
    if (!value.is_boolean()) fail(quoted(key) + " is neither true nor false");
    return value.get<bool>();
}

std::optional<std::vector<double>> three_numbers(const nlohmann::json& object, const char* key) {
    const auto list = object.find(key);
    std::vector<double> numbers;
    if (list == object.end() || list->size() != 3 || !add_numbers(*list, 3, numbers)) return std::nullopt;
    return numbers;
}

template <class Json>
std::string text_in(const Json& object, const char* key) {
    const auto found = object.find(key);
    return found != object.end() && found->is_string() ? found->template get<std::string>() : std::string();
}

template <class Json>
std::optional<double> number_in(const Json& object, const char* key) {
    const auto found = object.find(key);
    if (found == object.end() || !is_finite(*found)) return std::nullopt;
    return found->template get<double>();
}

template std::string text_in(const nlohmann::json&, const char*);
template std::string text_in(const nlohmann::ordered_json&, const char*);
template std::optional<double> number_in(const nlohmann::json&, const char*);
template std::optional<double> number_in(const nlohmann::ordered_json&, const char*);

}  // namespace ewa::core
