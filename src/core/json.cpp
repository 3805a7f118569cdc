// SPDX-License-Identifier: Apache-2.0
#include "core/json.h"

#include <algorithm>
#include <limits>
#include <nlohmann/json.hpp>
#include <type_traits>
#include <vector>

#include "core/atomic_file.h"
#include "core/file_reader.h"
#include "core/folders.h"
#include "core/text.h"
#include "ewa/error.h"

namespace ewa::core {

namespace {

constexpr size_t kMostOrderedKeys = 1024;
constexpr size_t kLongestReason = 100;  // limits what is quoted of the text
constexpr char kNotFinite =
    '\x7f';  // begins the string that stands for such a number; no writer has it in a text

/// Builds the value from nlohmann's parser events. nlohmann's own callback searches the parent at the end of
/// every object and list, which takes quadratic time.
template <class Json>
class Builder : public nlohmann::json_sax<Json> {
  public:
    Builder(const std::string& name, const JsonLimits& limits) : name_(name), limits_(limits) {}

    Json take() { return std::move(top_); }

    bool null() override { return leaf(nullptr); }
    bool boolean(bool value) override { return leaf(value); }
    bool number_integer(typename Json::number_integer_t value) override { return leaf(value); }
    bool number_unsigned(typename Json::number_unsigned_t value) override { return leaf(value); }
    bool number_float(typename Json::number_float_t value, const std::string&) override {
        return leaf(value);
    }
    bool string(std::string& value) override {
        if (limits_.not_finite && value.starts_with(kNotFinite))
            return leaf(std::numeric_limits<double>::quiet_NaN());
        return leaf(std::move(value));
    }
    bool binary(typename Json::binary_t&) override { return false; }  // JSON text has none

    bool start_object(std::size_t) override {
        if (skipping()) return descend();
        count(++objects_ > limits_.objects);
        return open(Json::object());
    }
    bool start_array(std::size_t) override {
        if (skipping()) return descend();
        count(++values_ > limits_.values);
        return open(Json::array());
    }
    bool key(std::string& key) override {
        if (skipping()) return true;
        skipped_from_ = !limits_.skipped.empty() && key == limits_.skipped ? depth_ : -1;
        key_ = std::move(key);
        return true;
    }
    bool end_object() override { return close(); }
    bool end_array() override { return close(); }

    bool parse_error(std::size_t byte, const std::string& token,
                     const nlohmann::json::exception& error) override {
        throw InputError(name_ + ": byte " + std::to_string(limits_.begin + byte) +
                         ": not valid JSON: " + reason(token, error));
    }

  private:
    /// In plain words: nlohmann's message names its exception and its parser's states.
    static std::string reason(const std::string& token, const nlohmann::json::exception& error) {
        constexpr int kNumberOverflow = 406;
        const std::string shown = one_line(token).substr(0, kLongestReason);
        if (error.id == kNumberOverflow) return "the number " + shown + " is too large";
        if (std::string_view(error.what()).find("ill-formed UTF-8") != std::string_view::npos)
            return "a text that is not UTF-8";
        // nlohmann 3.11.3 has other words for an empty text.
        if (token.empty() ||
            std::string_view(error.what()).find("unexpected end of input") != std::string_view::npos)
            return "the text ends too early";
        return "unexpected '" + shown + "'";
    }

    /// Whether the current value is skipped or is part of a skipped value.
    bool skipping() const { return skipped_from_ >= 0; }

    void count(bool too_many) const {
        if (too_many)
            throw InputError(name_ + ": the JSON has more than " + std::to_string(limits_.objects) +
                             " objects or " + std::to_string(limits_.values) + " values");
    }

    template <class Value>
    bool leaf(Value&& value) {
        if (skipping()) {
            if (depth_ == skipped_from_) skipped_from_ = -1;
            return true;
        }
        count(++values_ > limits_.values);
        place(std::forward<Value>(value));
        return true;
    }

    template <class Value>
    Json& place(Value&& value) {
        if (open_.empty()) return top_ = Json(std::forward<Value>(value));
        Json& parent = *open_.back();
        if (parent.is_array()) return parent.emplace_back(std::forward<Value>(value));
        if (std::is_same_v<Json, nlohmann::ordered_json> && parent.size() >= kMostOrderedKeys)
            throw InputError(name_ + ": the JSON has an object of more than " +
                             std::to_string(kMostOrderedKeys) + " keys");
        return parent[std::move(key_)] = Json(std::forward<Value>(value));
    }

    bool open(Json&& container) {
        descend();
        open_.push_back(&place(std::move(container)));  // the parent does not grow until it is closed
        return true;
    }

    bool descend() {
        if (++depth_ > limits_.depth)
            throw InputError(name_ + ": the JSON nests deeper than " + std::to_string(limits_.depth) +
                             " levels");
        return true;
    }

    bool close() {
        --depth_;
        if (!skipping())
            open_.pop_back();
        else if (depth_ == skipped_from_)
            skipped_from_ = -1;
        return true;
    }

    const std::string& name_;
    const JsonLimits& limits_;
    Json top_;
    std::vector<Json*> open_;
    std::string key_;
    int depth_ = 0, skipped_from_ = -1;  // the depth of the key whose value is skipped; -1: none
    size_t objects_ = 0, values_ = 0;
};

/// The text with strings of the same length in place of numbers that are not finite: nlohmann's parser refuses these.
std::string with_marks(std::string_view text, bool comments) {
    std::string marked(text);
    for (size_t i = 0; i < text.size(); ++i) {
        const std::string_view rest = text.substr(i);
        if (rest[0] == '"') {
            for (++i; i < text.size() && text[i] != '"'; ++i) i += text[i] == '\\';
        } else if (comments && rest.starts_with("//")) {
            i = std::min(text.find('\n', i), text.size());
        } else if (comments && rest.starts_with("/*")) {
            i = std::min(text.find("*/", i + 2), text.size());
        } else {
            for (const std::string_view word : {"NaN", "Infinity", "-Infinity"})
                if (rest.starts_with(word)) {
                    marked.replace(i, word.size(), word.size(), kNotFinite);
                    marked[i] = marked[i + word.size() - 1] = '"';
                    i += word.size() - 1;
                    break;
                }
        }
    }
    return marked;
}

void check_size(uint64_t bytes, const std::string& name, const JsonLimits& limits) {
    if (bytes > limits.bytes)
        throw InputError(name + ": the JSON has " + std::to_string(bytes) + " bytes, more than " +
                         std::to_string(limits.bytes));
}

}  // namespace

template <class Json>
Json parse_json(std::string_view text, const std::string& name, const JsonLimits& limits) {
    check_size(text.size(), name, limits);
    refuse_utf16(text, name);
    Builder<Json> builder(name, limits);
    std::string marked;
    if (limits.not_finite && (text.find("NaN") != text.npos || text.find("Infinity") != text.npos))
        text = marked = with_marks(text, limits.comments);
    constexpr bool kWhole = true;
    Json::sax_parse(text.begin(), text.end(), &builder, nlohmann::detail::input_format_t::json, kWhole,
                    limits.comments);
    return builder.take();
}

template <class Json>
Json read_json_file(const std::filesystem::path& path, const JsonLimits& limits) {
    FileReader reader(path);
    check_size(reader.size(), reader.name(), limits);
    const size_t size = size_t(reader.size());
    return parse_json<Json>({reinterpret_cast<const char*>(reader.take(size, "the text")), size},
                            reader.name(), limits);
}

template nlohmann::json parse_json(std::string_view, const std::string&, const JsonLimits&);
template nlohmann::ordered_json parse_json(std::string_view, const std::string&, const JsonLimits&);
template nlohmann::json read_json_file(const std::filesystem::path&, const JsonLimits&);
template nlohmann::ordered_json read_json_file(const std::filesystem::path&, const JsonLimits&);

void write_json(const std::filesystem::path& path, const nlohmann::ordered_json& json) {
    make_folder(path.parent_path());
    write_text_file(path, json.dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + "\n");
}

}  // namespace ewa::core
