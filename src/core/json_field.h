// SPDX-License-Identifier: Apache-2.0
// A value of a JSON file together with where it is, so that each error names the file and the place.
#pragma once
#include <cstdint>
#include <filesystem>
#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "core/json.h"

namespace ewa::core {

/// A JSON value with its place in the file. Functions with a key read this member; with a null key, the value itself.
class JsonField {
  public:
    /// where: the file and the value's place in it. advice: text that errors add to "is missing". The value must outlive the field.
    JsonField(const nlohmann::json& value, std::string where, std::string advice = {})
        : value_(&value), where_(std::move(where)), advice_(std::move(advice)) {}

    /// The whole value of a file or of a text. The field and its copies own the value. Throws InputError.
    static JsonField of_file(const std::filesystem::path& file, const JsonLimits& limits = {},
                             std::string advice = {});
    static JsonField of_text(std::string_view text, const std::string& name, const JsonLimits& limits = {},
                             std::string advice = {});

    /// This field with defaults: members that it lacks are taken from `other`, which must outlive the field.
    JsonField or_of(const nlohmann::json& other) const;

    const nlohmann::json& value() const { return *value_; }
    const std::string& where() const { return where_; }
    /// Whether an object has the key, with another value than null.
    bool has(const char* key) const;
    /// A required member. Throws if it is missing, or the value is no object. The result's place in errors is this field's,
    /// then `what` if that is not empty.
    JsonField at(const char* key, const std::string& what = {}) const;
    /// list() is a member that is a list, members() one that is an object. They throw for other values. The results live as long as
    /// the field's value.
    const nlohmann::json& list(const char* key) const;
    const nlohmann::json& members(const char* key) const;
    JsonField object(const char* key) const;
    /// A member that is an object. The result's place in errors is this field's place and the key.
    JsonField part(const char* key) const;
    /// The items of a member that is a list. The place of each in errors is this field's place, the key, and the item's index.
    std::vector<JsonField> items(const char* key) const;

    /// A member that is a finite number. absent: the result if the member is missing; number_if() is then empty.
    double number(const char* key) const;
    double number(const char* key, double absent) const;
    std::optional<double> number_if(const char* key) const;
    /// A member that is a list of `least` to `most` finite numbers, or a list of equally long rows of them. form: what errors say
    /// is expected; null: a text about the list.
    std::vector<double> numbers(const char* key, size_t least, size_t most, const char* form = nullptr) const;
    std::vector<double> numbers(const char* key, size_t count) const { return numbers(key, count, count); }
    /// As numbers(), for numbers that are finite as floats.
    std::vector<float> floats(const char* key, size_t count, const char* form = nullptr) const;
    /// A member that is a whole number from `least` to `most`.
    uint64_t whole(const char* key, uint64_t most, uint64_t least = 0) const;
    /// A side of an image in px.
    int side(const char* key) const;
    const std::string& text(const char* key) const;
    std::string text(const char* key, const std::string& absent) const;
    /// true or false; false without the key.
    bool flag(const char* key) const;

    [[noreturn]] void fail(const std::string& text) const;

  private:
    const nlohmann::json& member(const char* key) const;
    /// Throws InputError that says what is expected instead of the member's value.
    [[noreturn]] void fail(const char* key, const std::string& expected) const;

    std::shared_ptr<const nlohmann::json> whole_;  // null: another one keeps the value
    const nlohmann::json* value_;
    const nlohmann::json* other_ = nullptr;
    std::string where_, advice_;
};

/// The three finite numbers of an object's member; no value for anything else.
std::optional<std::vector<double>> three_numbers(const nlohmann::json& object, const char* key);

/// The text of an object's member; empty for anything else. Json is nlohmann::json or ordered_json.
template <class Json>
std::string text_in(const Json& object, const char* key);

/// The finite number of an object's member; no value for anything else.
template <class Json>
std::optional<double> number_in(const Json& object, const char* key);

}  // namespace ewa::core
