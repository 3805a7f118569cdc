// SPDX-License-Identifier: Apache-2.0
// A value of a JSON file together with where it is, so that each error names the file and the place.
#pragma once
#include <cstdint>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

namespace ewa::core {

class JsonField {
  public:
    /// where: the file, and what of it. The value must outlive the field.
    JsonField(const nlohmann::json& value, std::string where) : value_(&value), where_(std::move(where)) {}

    const nlohmann::json& value() const { return *value_; }
    const std::string& where() const { return where_; }
    /// Whether an object has the key, with another value than null.
    bool has(const char* key) const;
    /// A member that must be there. The place of the result is this one's, with `what` added if it is not empty.
    JsonField at(const char* key, const std::string& what = {}) const;
    /// Throws unless the member is a list or an object. The values outlive the field, as its own does.
    const nlohmann::json& list(const char* key) const;
    const nlohmann::json& members(const char* key) const;
    JsonField object(const char* key) const;

    /// Finite numbers.
    double number(const char* key) const;
    double number(const char* key, double absent) const;
    /// A list of `count` finite numbers; lists in the list count with their numbers.
    std::vector<double> numbers(const char* key, size_t count) const;
    /// A side of an image in px.
    int side(const char* key) const;
    /// 0 or more, below 2^53.
    uint64_t index(const char* key) const;
    std::string text(const char* key) const;

    [[noreturn]] void fail(const std::string& text) const;

  private:
    const nlohmann::json& member(const char* key) const;

    const nlohmann::json* value_;
    std::string where_;
};

/// Three finite numbers; empty for anything else.
std::optional<std::vector<double>> three_numbers(const nlohmann::json& value);

}  // namespace ewa::core
