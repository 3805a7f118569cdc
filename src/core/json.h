// SPDX-License-Identifier: Apache-2.0
// JSON: reads it from untrusted sources with limits, and writes files.
#pragma once
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <string_view>

namespace ewa::core {

/// Limits of a JSON text. They exist because a value may need some hundred bytes of memory, however short its text is.
struct JsonLimits {
    uint64_t bytes = uint64_t(256) << 20;  // of the text
    int depth = 64;
    size_t objects = size_t(1) << 20;
    size_t values = size_t(1) << 22;  // lists and scalars
    bool comments = false;            // whether // and /* */ are allowed between values
    /// Reads NaN, Infinity and -Infinity as numbers, because Python writes them. All become NaN.
    bool not_finite = false;
    std::string_view skipped = {};  // values of this key are neither kept nor counted; empty: none
    uint64_t begin = 0;             // offset of the text in its file, for errors
};

/// Parses the text in one pass and without recursion. The time is linear in the length, times the logarithm
/// of a key's lookup. The last of duplicate keys wins, as in nlohmann's parser. ordered_json compares each
/// key with all others, so its objects are limited to 1024 keys. `name` is the file or the sender of the
/// text. Throws InputError "name: byte N: ..." if the JSON is invalid, continues after the value, or exceeds
/// a limit. Json is nlohmann::json or ordered_json.
template <class Json>
Json parse_json(std::string_view text, const std::string& name, const JsonLimits& limits = {});

/// Parses a file as parse_json() does. Throws InputError also if the file cannot be read.
template <class Json>
Json read_json_file(const std::filesystem::path& path, const JsonLimits& limits = {});

/// Writes the value with two spaces of indentation, as write_text_file does. Creates the file's folder. Bytes
/// that are not UTF-8 become U+FFFD. Throws RunError.
void write_json(const std::filesystem::path& path, const nlohmann::ordered_json& json);

}  // namespace ewa::core
