// SPDX-License-Identifier: Apache-2.0
#include "io/splats/usd_text.h"

#include <algorithm>
#include <charconv>
#include <utility>

#include "core/text.h"
#include "ewa/error.h"

namespace ewa::io {

namespace {

constexpr int kMostNested = 200;  // prims in prims, and brackets in brackets

bool is_space(char c) {
    return c == ' ' || c == '\t' || c == '\n' || c == '\r' || c == ';';
}
bool is_word(char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' ||
           c == ':' || c == '.';
}

}  // namespace

/// Reads the text from a byte on.
class UsdParser {
  public:
    UsdParser(const UsdText& layer, size_t at) : layer_(layer), text_(layer.text_), at_(at) {}

    size_t at() const { return at_; }
    bool at_end() {
        space();
        return at_ >= text_.size();
    }
    /// The next character that is no space; 0 at the end.
    char next() {
        space();
        return at_ < text_.size() ? text_[at_] : '\0';
    }
    bool take(char c) {
        if (next() != c) return false;
        ++at_;
        return true;
    }
    void expect(char c) {
        if (!take(c)) fail(std::string("'") + c + "' is missing");
    }
    std::string word() {
        space();
        const size_t begin = at_;
        while (at_ < text_.size() && is_word(text_[at_])) ++at_;
        return text_.substr(begin, at_ - begin);
    }

    /// The content of a string in single, double or triple quotes, without unescaping it.
    std::string quoted() {
        const char quote = next();
        if (quote != '"' && quote != '\'') fail("a text in quotes is missing");
        const bool triple = text_.compare(at_, 3, std::string(3, quote)) == 0;
        const std::string end(triple ? 3 : 1, quote);
        const size_t begin = at_ += end.size();
        for (; at_ < text_.size(); ++at_) {
            if (text_[at_] == '\\')
                ++at_;
            else if (text_.compare(at_, end.size(), end) == 0) {
                at_ += end.size();
                return text_.substr(begin, at_ - begin - end.size());
            }
        }
        at_ = begin;
        fail("a text in quotes has no end");
    }

    /// Passes a value of any type.
    void skip_value() {
        switch (const char c = next()) {
            case '(':
                skip_brackets(')');
                return;
            case '[':
                skip_brackets(']');
                return;
            case '{':
                skip_brackets('}');
                return;
            case '"':
            case '\'':
                quoted();
                return;
            case '@':
                skip_to("@");
                return;
            case '<':
                skip_to(">");
                return;
            default:
                if (c != '-' && c != '+' && !is_word(c)) fail("a value is missing");
                if (c == '-' || c == '+') ++at_;
                while (at_ < text_.size() && (is_word(text_[at_]) || text_[at_] == '+' || text_[at_] == '-'))
                    ++at_;
        }
    }

    /// The text between parentheses, if they are next.
    std::string parentheses() {
        if (next() != '(') return {};
        const size_t begin = at_ + 1;
        skip_brackets(')');
        return text_.substr(begin, at_ - 1 - begin);
    }

    std::vector<UsdPrim> prims(char end, int depth) {
        std::vector<UsdPrim> list;
        while (end ? !take(end) : !at_end()) {
            UsdPrim unused;
            statement(list, unused, depth);
            if (!unused.properties.empty()) fail("a property is outside of a prim");
        }
        return list;
    }

    double number() {
        space();
        if (at_ < text_.size() && text_[at_] == '+') ++at_;
        double value = 0;
        const auto [end, error] = std::from_chars(&text_[at_], text_.data() + text_.size(), value);
        if (error != std::errc()) fail("a number is missing, or it is too large");
        at_ = size_t(end - text_.data());
        return value;
    }

    [[noreturn]] void fail(const std::string& message) const { layer_.fail(at_, message); }

  private:
    void space() {
        while (at_ < text_.size()) {
            if (text_[at_] == '#')
                while (at_ < text_.size() && text_[at_] != '\n') ++at_;
            else if (is_space(text_[at_]))
                ++at_;
            else
                return;
        }
    }

    void skip_to(const char* end) {
        const size_t found = text_.find(end, at_ + 1);
        if (found == std::string::npos) fail(std::string("'") + end + "' is missing");
        at_ = found + 1;
    }

    void skip_brackets(char end) {
        const size_t begin = at_;
        std::string open(1, end);
        ++at_;
        while (!open.empty()) {
            const char c = next();
            if (c == '\0') {
                at_ = begin;
                fail("a bracket is not closed");
            }
            if (c == '"' || c == '\'') {
                quoted();
                continue;
            }
            if (c == '@') {
                skip_to("@");
                continue;
            }
            if (c == '(') open += ')';
            if (c == '[') open += ']';
            if (c == '{') open += '}';
            if (c == ')' || c == ']' || c == '}') {
                if (open.back() != c) fail(std::string("'") + open.back() + "' is missing");
                open.pop_back();
            }
            if (open.size() > kMostNested) fail("brackets are nested too deeply");
            ++at_;
        }
    }

    void statement(std::vector<UsdPrim>& children, UsdPrim& owner, int depth) {
        const size_t begin = (next(), at_);
        std::string first = word();
        if (first.empty()) fail("a prim or a property is missing");
        if (first == "def" || first == "over" || first == "class") {
            children.push_back(prim(first, begin, depth));
        } else if (first == "variantSet") {
            owner.variants = true;
            quoted();
            expect('=');
            skip_value();
        } else if (first == "reorder") {
            word();
            expect('=');
            skip_value();
        } else {
            property(std::move(first), owner);
        }
    }

    UsdPrim prim(const std::string& specifier, size_t begin, int depth) {
        if (depth > kMostNested) fail("prims are nested too deeply");
        UsdPrim prim;
        prim.specifier = specifier;
        prim.byte = begin;
        prim.type = word();
        prim.name = quoted();
        prim.metadata = parentheses();
        expect('{');
        while (!take('}')) {
            if (next() == '\0') fail("'}' is missing");
            statement(prim.children, prim, depth + 1);
        }
        return prim;
    }

    void property(std::string first, UsdPrim& owner) {
        static constexpr std::string_view kBefore[] = {"custom",  "uniform", "varying", "config",
                                                       "prepend", "append",  "delete",  "add"};
        UsdProperty property;
        property.type = std::move(first);
        while (std::find(std::begin(kBefore), std::end(kBefore), property.type) != std::end(kBefore))
            property.type = word();
        if (take('[')) {
            expect(']');
            property.type += "[]";
        }
        property.name = word();
        if (property.type.empty() || property.name.empty()) fail("the name of a property is missing");
        if (take('=')) {
            next();
            property.value = at_;
            skip_value();
            owner.properties.push_back(std::move(property));
        }
        parentheses();
    }

    const UsdText& layer_;
    const std::string& text_;
    size_t at_;
};

const UsdProperty* UsdPrim::property(std::string_view named) const {
    const auto found = std::find_if(properties.begin(), properties.end(),
                                    [&](const UsdProperty& p) { return p.name == named; });
    return found == properties.end() ? nullptr : &*found;
}

UsdText::UsdText(std::string name, std::string text) : name_(std::move(name)), text_(std::move(text)) {
    if (!text_.starts_with("#usda ")) fail(0, "the first line is not \"#usda 1.0\"");
    UsdParser parser(*this, 0);
    metadata_ = parser.parentheses();
    prims_ = parser.prims('\0', 0);
}

std::vector<float> UsdText::floats(const UsdProperty& property, size_t each) const {
    UsdParser parser(*this, property.value);
    const bool array = parser.take('[');
    std::vector<float> values;
    while (!(array && parser.take(']'))) {
        if (each > 1) parser.expect('(');
        for (size_t k = 0; k < each; ++k) {
            if (k > 0) parser.expect(',');
            values.push_back(float(parser.number()));
        }
        if (each > 1) parser.expect(')');
        if (!array) break;
        if (!parser.take(',') && parser.next() != ']') parser.expect(']');
    }
    return values;
}

std::vector<double> UsdText::doubles(const UsdProperty& property, size_t count) const {
    UsdParser parser(*this, property.value);
    std::vector<double> values;
    while (values.size() < count) {
        while (parser.take('(') || parser.take(')') || parser.take(',')) {
        }
        values.push_back(parser.number());
    }
    return values;
}

std::vector<std::string> UsdText::words(const UsdProperty& property) const {
    UsdParser parser(*this, property.value);
    if (!parser.take('[')) return {parser.quoted()};
    std::vector<std::string> words;
    while (!parser.take(']')) {
        words.push_back(parser.quoted());
        if (!parser.take(',') && parser.next() != ']') parser.expect(']');
    }
    return words;
}

std::string UsdText::word(const UsdProperty& property) const {
    std::vector<std::string> all = words(property);
    if (all.size() != 1)
        fail(property.value, property.name + " is one text, not a list of " + std::to_string(all.size()));
    return std::move(all.front());
}

void UsdText::fail(size_t byte, const std::string& message) const {
    const size_t end = std::min(byte, text_.size());
    const auto line = 1 + std::count(text_.begin(), text_.begin() + std::ptrdiff_t(end), '\n');
    throw InputError(name_ + ": line " + std::to_string(line) + ": " + core::one_line(message));
}

std::optional<std::string> usd_metadata(const std::string& metadata, std::string_view key) {
    for (size_t at = metadata.find(key); at != std::string::npos; at = metadata.find(key, at + 1)) {
        if (at > 0 && is_word(metadata[at - 1])) continue;
        size_t value = metadata.find_first_not_of(" \t", at + key.size());
        if (value == std::string::npos || metadata[value] != '=') continue;
        value = metadata.find_first_not_of(" \t\"", value + 1);
        if (value == std::string::npos) continue;
        size_t end = value;
        while (end < metadata.size() && is_word(metadata[end])) ++end;
        return metadata.substr(value, end - value);
    }
    return std::nullopt;
}

}  // namespace ewa::io
