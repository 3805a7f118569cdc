// SPDX-License-Identifier: Apache-2.0
// JSON that somebody else may have written.
#pragma once
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <string_view>

namespace ewa::core {

/// What a text may hold at most. A value takes up to some hundred bytes of memory, whatever its text takes.
struct JsonLimits {
    uint64_t bytes = uint64_t(256) << 20;  // of the text
    int depth = 64;
    size_t objects = size_t(1) << 20;
    size_t values = size_t(1) << 22;  // lists, and what is neither list nor object
    bool comments = false;            // whether // and /* */ may stand between values
    std::string_view left_out = {};  // what stands under this key is neither kept nor counted; empty: nothing
    uint64_t begin = 0;              // the byte of the file that the text begins at
};

/// The value, in one pass over the text, in time linear in its length (but for the logarithm that finds a
/// key) and on no stack that the text could fill. Of a key that stands twice in an object the last counts, as
/// in nlohmann's own parser. ordered_json looks through all keys for each, so an object of it has at most
/// 1024. name: of the file or of whatever it is that sent the text. Throws InputError "name: byte N: ..." for
/// a text that is no JSON, one with anything behind the value, and one past a limit.
template <class Json>
Json parse_json(std::string_view text, const std::string& name, const JsonLimits& limits = {});

/// The same of a file. Throws InputError also for what cannot be read.
template <class Json>
Json read_json_file(const std::filesystem::path& path, const JsonLimits& limits = {});

extern template nlohmann::json parse_json(std::string_view, const std::string&, const JsonLimits&);
extern template nlohmann::ordered_json parse_json(std::string_view, const std::string&, const JsonLimits&);
extern template nlohmann::json read_json_file(const std::filesystem::path&, const JsonLimits&);
extern template nlohmann::ordered_json read_json_file(const std::filesystem::path&, const JsonLimits&);

}  // namespace ewa::core
