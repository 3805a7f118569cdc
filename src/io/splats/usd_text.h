// SPDX-License-Identifier: Apache-2.0
// The text format of OpenUSD (.usda): the tree of its prims, whose values are read when they are asked for.
#pragma once
#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace ewa::io {

struct UsdProperty {
    std::string type, name;  // e.g. "point3f[]" and "positions"
    size_t value;            // byte of the value in the text
};

struct UsdPrim {
    std::string specifier, type, name;  // "def" and "Xform"; the type may be empty
    std::string metadata;               // what parentheses after the name hold; may be empty
    size_t byte = 0;                    // of the specifier
    bool variants = false;              // it has variant sets, which are skipped
    std::vector<UsdProperty> properties;
    std::vector<UsdPrim> children;

    const UsdProperty* property(std::string_view named) const;
};

/// A layer in memory. Relationships, and what other layers would add, are not followed.
class UsdText {
  public:
    /// `name` is what errors name. Throws InputError "name: line N: ..." for text that is no layer.
    UsdText(std::string name, std::string text);

    const std::string& name() const { return name_; }
    const std::string& metadata() const { return metadata_; }  // of the layer
    const std::vector<UsdPrim>& prims() const { return prims_; }
    size_t bytes() const { return text_.size(); }

    /// The numbers of an array or a single value, whose elements are tuples of `each` numbers, or plain ones if each is 1.
    /// Throws InputError.
    std::vector<float> floats(const UsdProperty& property, size_t each) const;
    /// The same in double. Nested tuples, as those of a matrix, are read in order; `count` numbers must be there.
    std::vector<double> doubles(const UsdProperty& property, size_t count) const;
    /// A token or string, or an array of them. Throws InputError.
    std::vector<std::string> words(const UsdProperty& property) const;
    /// The one token or string. Throws InputError for more, and for an empty array.
    std::string word(const UsdProperty& property) const;
    bool contains(std::string_view text) const { return text_.find(text) != std::string::npos; }

    /// Throws InputError with the line of a byte.
    [[noreturn]] void fail(size_t byte, const std::string& message) const;

  private:
    friend class UsdParser;
    std::string name_, text_, metadata_;
    std::vector<UsdPrim> prims_;
};

/// The value of `key = value` in metadata, without quotes; nothing if it is not there.
std::optional<std::string> usd_metadata(const std::string& metadata, std::string_view key);

}  // namespace ewa::io
