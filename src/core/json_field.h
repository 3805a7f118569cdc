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

/// A key names a member; null is the value itself.
class JsonField {
  public:
    /// where: the file, and what of it. advice: what an error says behind "is missing". The value must outlive the field.
    JsonField(const nlohmann::json& value, std::string where, std::string advice = {})
        : value_(&value), where_(std::move(where)), advice_(std::move(advice)) {}

    /// The whole of a file or of a text, which the field and its copies keep. Throws InputError.
    static JsonField of_file(const std::filesystem::path& file, const JsonLimits& limits = {},
                             std::string advice = {});
    static JsonField of_text(std::string_view text, const std::string& name, const JsonLimits& limits = {},
                             std::string advice = {});

    /// The same field. A member that it lacks is that of the other object, which outlives the field.
    JsonField or_of(const nlohmann::json& other) const;

    const nlohmann::json& value() const { return *value_; }
    const std::string& where() const { return where_; }
    /// Whether an object has the key, with another value than null.
    bool has(const char* key) const;
    /// A member that must be there. Throws also if the value is no object. The place of the result is this one's, with `what` added
    /// if it is not empty.
    JsonField at(const char* key, const std::string& what = {}) const;
    /// Throws unless the member is a list or an object. The values outlive the field, as its own does.
    const nlohmann::json& list(const char* key) const;
    const nlohmann::json& members(const char* key) const;
    JsonField object(const char* key) const;
    /// An object whose place has the key.
    JsonField part(const char* key) const;
    /// The values of a list, whose places have the key and their numbers.
    std::vector<JsonField> items(const char* key) const;

    /// Finite numbers.
    double number(const char* key) const;
    double number(const char* key, double absent) const;
    std::optional<double> number_if(const char* key) const;
    /// A list of `least` to `most` finite numbers; rows of a list, which are equally long, count with their numbers. form: what an
    /// error says that is expected; null: the list.
    std::vector<double> numbers(const char* key, size_t least, size_t most, const char* form = nullptr) const;
    std::vector<double> numbers(const char* key, size_t count) const { return numbers(key, count, count); }
    /// The same with numbers that are finite as floats.
    std::vector<float> floats(const char* key, size_t count, const char* form = nullptr) const;
    /// A whole number.
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
    /// Throws for a value that is not what is expected.
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
