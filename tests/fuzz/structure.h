// SPDX-License-Identifier: Apache-2.0
// Changes of structure: what another program, or a hand that knows the format, makes of a file. They work on any text with brackets
// or tags: JSON, XML, the head of a PLY. In a .glb and a zip archive they change the text inside, and the container fits again.
#pragma once
#include <algorithm>
#include <array>
#include <cstdint>
#include <cstring>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/random.h"
#include "io/splats/archive.h"

namespace ewa::fuzz {

/// `bytes` after one to three changes, which depend on the seed alone. `other` lends values and names.
class Structure {
  public:
    explicit Structure(uint32_t seed) : seed_(seed) {}

    std::string of(const std::string& bytes, const std::string& other) {
        std::string out = bytes;
        for (uint32_t n = 1 + below(3); n > 0; --n) out = changed(out, text_of(other));
        return out;
    }

  private:
    /// A part of the text. Brackets and quotes belong to it.
    struct Span {
        size_t begin, end;
        size_t size() const { return end - begin; }
    };

    uint32_t below(size_t limit) {
        return limit == 0 ? 0 : core::pcg4d({seed_, next_++, 3, 4})[0] % uint32_t(limit);
    }
    template <class List>
    const auto& one_of(const List& list) {
        return list[below(std::size(list))];
    }

    static uint32_t word(const std::string& bytes, size_t at) {
        uint32_t value = 0;
        if (at + sizeof(value) <= bytes.size()) std::memcpy(&value, &bytes[at], sizeof(value));
        return value;
    }
    static std::string word_of(uint32_t value) {
        return {reinterpret_cast<const char*>(&value), sizeof(value)};
    }

    static constexpr size_t kGlbJson = 20;  // byte at which the JSON of a .glb begins

    /// The size of the JSON of a .glb with its padding.
    static std::optional<size_t> glb_json(const std::string& bytes) {
        if (bytes.starts_with("glTF") && word(bytes, 12) + uint64_t(kGlbJson) <= bytes.size())
            return word(bytes, 12);
        return std::nullopt;
    }

    static std::vector<std::pair<std::string, std::string>> entries_of(const std::string& bytes) {
        std::vector<std::pair<std::string, std::string>> entries;
        for (size_t at = 0; at + 30 <= bytes.size() && word(bytes, at) == 0x04034b50;) {
            const size_t name = word(bytes, at + 26) & 0xffff, more = word(bytes, at + 28) & 0xffff,
                         size = word(bytes, at + 18), begin = at + 30 + name + more;
            if (begin > bytes.size() || size > bytes.size() - begin) break;
            entries.emplace_back(bytes.substr(at + 30, name), bytes.substr(begin, size));
            at = begin + size;
        }
        return entries;
    }

    static std::string text_of(const std::string& bytes) {
        if (const auto size = glb_json(bytes)) return bytes.substr(kGlbJson, *size);
        for (const auto& [name, content] : entries_of(bytes))
            if (is_text(content)) return content;
        return bytes;
    }

    static bool is_text(const std::string& bytes) {
        return !bytes.empty() &&
               std::all_of(
                   bytes.begin(), bytes.begin() + std::min<ptrdiff_t>(64, ptrdiff_t(bytes.size())),
                   [](char c) { return c == '\n' || c == '\r' || c == '\t' || (c >= ' ' && c < 127); });
    }

    std::string changed(const std::string& bytes, const std::string& other) {
        if (const auto size = glb_json(bytes)) {
            std::string text = changed_text(bytes.substr(kGlbJson, *size), other);
            text.resize((text.size() + 3) / 4 * 4, ' ');
            std::string out = bytes.substr(0, kGlbJson) + text + bytes.substr(kGlbJson + *size);
            out.replace(12, 4, word_of(uint32_t(text.size())));
            out.replace(8, 4, word_of(uint32_t(out.size())));
            return out;
        }
        if (auto entries = entries_of(bytes); !entries.empty()) {
            io::ArchiveWriter archive;
            auto& [name, content] = entries[below(entries.size())];
            if (below(8) == 0)
                name = one_of(entries).first;
            else if (is_text(content))
                content = changed_text(content, other);
            for (const auto& [entry, bytes_of_entry] : entries) archive.add(entry, bytes_of_entry);
            return archive.finish();
        }
        return is_text(bytes) ? changed_text(bytes, other) : with_limit(bytes);
    }

    /// A number at a multiple of its size at the beginning of a binary file.
    std::string with_limit(std::string bytes) {
        constexpr std::array<uint64_t, 8> kLimits = {0,      1,          0x7f,       0xff,
                                                     0xffff, 0x7fffffff, 0xffffffff, UINT64_MAX};
        const size_t size = size_t(1) << below(4),
                     at = below(std::min<size_t>(bytes.size(), 128)) / size * size;
        const uint64_t limit = one_of(kLimits);
        if (at + size <= bytes.size()) std::memcpy(&bytes[at], &limit, size);
        return bytes;
    }

    /// Values of the text: brackets with what is between them, quoted texts, numbers and words.
    static std::vector<Span> spans_of(const std::string& text) {
        std::vector<Span> spans;
        std::vector<size_t> open;
        const auto is_word = [](char c) {
            return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_' ||
                   c == '.' || c == '-' || c == '+' || c == ':';
        };
        for (size_t i = 0; i < text.size();) {
            const char c = text[i];
            if (c == '"' || c == '\'') {
                size_t end = i + 1;
                while (end < text.size() && text[end] != c && text[end] != '\n')
                    end += text[end] == '\\' ? 2 : 1;
                end = std::min(end + 1, text.size());
                spans.push_back({i, end});
                i = end;
            } else if (c == '[' || c == '{' || c == '(' || c == '<') {
                open.push_back(i++);
            } else if (c == ']' || c == '}' || c == ')' || c == '>') {
                ++i;
                if (!open.empty()) {
                    spans.push_back({open.back(), i});
                    open.pop_back();
                }
            } else if (is_word(c) && c != ':') {
                const size_t begin = i;
                while (i < text.size() && is_word(text[i])) ++i;
                if (text[i - 1] == ':') --i;
                spans.push_back({begin, i});
                i += i < text.size() && text[i] == ':' ? 1 : 0;
            } else {
                ++i;
            }
        }
        return spans;
    }

    static bool is_list(const std::string& text, const Span& span) {
        return span.size() >= 2 && std::string_view("[{(").find(text[span.begin]) != std::string_view::npos;
    }
    static bool is_number(const std::string& text, const Span& span) {
        return std::string_view("0123456789-+.").find(text[span.begin]) != std::string_view::npos;
    }
    /// Whether it is what gives a value its name.
    static bool is_name(const std::string& text, const Span& span) {
        const size_t next = text.find_first_not_of(" \t\n", span.end);
        return next != std::string::npos && (text[next] == ':' || text[next] == '=');
    }

    template <class Wanted>
    std::optional<Span> chosen(const std::string& text, const Wanted& wanted) {
        std::vector<Span> found;
        for (const Span& span : spans_of(text))
            if (wanted(text, span)) found.push_back(span);
        if (found.empty()) return std::nullopt;
        return one_of(found);
    }
    static std::string at(const std::string& text, const Span& span) {
        return text.substr(span.begin, span.size());
    }
    static void put(std::string& text, const Span& span, const std::string& value) {
        text.replace(span.begin, span.size(), value);
    }

    std::string changed_text(std::string text, const std::string& other) {
        constexpr size_t kLongest = size_t(1) << 20;
        if (text.size() > kLongest) return text;
        const auto any = [](const std::string&, const Span&) { return true; };
        const auto value = [](const std::string& all, const Span& span) { return !is_name(all, span); };
        switch (below(9)) {
            case 0:  // an empty list
                if (const auto span = chosen(text, is_list)) text.erase(span->begin + 1, span->size() - 2);
                break;
            case 1: {  // another type
                constexpr std::array kValues = {
                    "null", "true", "false",  "\"\"",    "\"a\"",      "0",  "-1",     "1.5",  "[]", "{}",
                    "[[]]", "[0]",  "[null]", "[\"a\"]", "{\"a\": 1}", "()", "(1, 2)", "None", "nan"};
                if (const auto span = chosen(text, value)) put(text, *span, one_of(kValues));
                break;
            }
            case 2: {  // a number at a limit
                constexpr std::array kNumbers = {"0",
                                                 "-0.0",
                                                 "1",
                                                 "-1",
                                                 "255",
                                                 "256",
                                                 "65536",
                                                 "2147483647",
                                                 "2147483648",
                                                 "-2147483648",
                                                 "4294967295",
                                                 "4294967296",
                                                 "9007199254740993",
                                                 "9223372036854775807",
                                                 "18446744073709551615",
                                                 "18446744073709551616",
                                                 "1e18",
                                                 "3e19",
                                                 "3.4e38",
                                                 "-3.4e38",
                                                 "1e39",
                                                 "1e308",
                                                 "1e309",
                                                 "1e-45",
                                                 "1e-320",
                                                 "-1e-30",
                                                 "inf",
                                                 "nan"};
                if (const auto span = chosen(text, is_number)) put(text, *span, one_of(kNumbers));
                break;
            }
            case 3: {  // a name for another
                const std::string& from = below(2) ? text : other;
                const auto span = chosen(text, is_name), lent = chosen(from, is_name);
                if (span && lent) put(text, *span, at(from, *lent));
                break;
            }
            case 4: {  // a value for another
                const auto span = chosen(text, value);
                const std::string& from = below(2) ? text : other;
                if (const auto lent = chosen(from, value); span && lent && lent->size() < 4096)
                    put(text, *span, at(from, *lent));
                break;
            }
            case 5:  // once more, or many times
                if (const auto span = chosen(text, any); span && span->size() < 4096) {
                    const uint32_t times = below(4) == 0 ? 1 + below(200) : 1;
                    std::string more;
                    for (uint32_t n = 0; n < times && more.size() < 65536; ++n)
                        more += separator(text, *span) + at(text, *span);
                    text.insert(span->end, more);
                }
                break;
            case 6:  // one less
                if (const auto span = chosen(text, any)) {
                    size_t end = text.find_first_not_of(" \t\n", span->end);
                    end = end != std::string::npos && text[end] == ',' ? end + 1 : span->end;
                    text.erase(span->begin, end - span->begin);
                }
                break;
            case 7:  // a property of the other file
                add_property(text, other);
                break;
            default:  // inside out
                if (const auto span = chosen(text, value); span && span->size() < 4096) {
                    const std::string inner = at(text, *span);
                    put(text, *span,
                        below(2)               ? "[" + inner + "]"
                        : is_list(text, *span) ? inner.substr(1, inner.size() - 2)
                                               : "{" + inner + "}");
                }
        }
        return text;
    }

    /// What stands between such a value and the next.
    static std::string separator(const std::string& text, const Span& span) {
        const size_t next = text.find_first_not_of(" \t\n", span.end);
        const size_t before = text.find_last_not_of(" \t\n", span.begin == 0 ? 0 : span.begin - 1);
        const bool comma = (next != std::string::npos && text[next] == ',') ||
                           (before != std::string::npos &&
                            std::string_view(",[").find(text[before]) != std::string_view::npos);
        return comma ? ", " : "\n";
    }

    void add_property(std::string& text, const std::string& other) {
        const std::string& from = below(2) ? text : other;
        const auto name = chosen(from, is_name), list = chosen(text, is_list);
        if (!name || !list || text[list->begin] == '(') return;
        // Up to the end of its value, which is a line or the next value.
        size_t begin = name->begin, end = from.find_first_of("\n,", name->end);
        for (const Span& span : spans_of(from))
            if (span.begin > name->end && span.begin < name->end + 4) end = span.end;
        if (from[name->end < from.size() ? name->end : 0] !=
            ':')  // XML: what stands before the name on its line
            begin = from.rfind('\n', begin) == std::string::npos ? begin : from.rfind('\n', begin) + 1;
        if (end == std::string::npos || end - begin > 4096) return;
        const bool first = text.find_first_not_of(" \t\n", list->begin + 1) == list->end - 1;
        const bool json = from[name->begin] == '"';
        text.insert(list->begin + 1, from.substr(begin, end - begin) + (json ? first ? "" : ", " : "\n"));
    }

    uint32_t seed_, next_ = 0;
};

}  // namespace ewa::fuzz
