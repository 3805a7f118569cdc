// SPDX-License-Identifier: Apache-2.0
#include "io/splats/ply_table.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "core/text.h"

namespace ewa::io {

namespace {

/// A word of the file for an error: a damaged one may be as long as the header.
std::string shown_word(std::string_view word) {
    constexpr size_t kShown = 60;
    std::string text = "\"";
    text += word.substr(0, kShown);
    return text += '"';
}

constexpr size_t kMaxHeaderLine = size_t(1) << 16;
constexpr uint64_t kMaxHeaderBytes = uint64_t(1) << 22;
constexpr size_t kMaxProperties = 1024;  // per element; each is compared with all before it
constexpr size_t kMaxWord = 512;         // longer than any number that a program writes

template <class T>
double as_double(const std::byte* bytes) {
    T value;
    std::memcpy(&value, bytes, sizeof(T));
    return static_cast<double>(value);
}

struct TypeInfo {
    std::string_view plain, sized;  // names
    size_t bytes;
    double (*read)(const std::byte*);
};
/// In the order of PlyType.
constexpr TypeInfo kTypes[] = {
    {"char", "int8", 1, as_double<int8_t>},    {"uchar", "uint8", 1, as_double<uint8_t>},
    {"short", "int16", 2, as_double<int16_t>}, {"ushort", "uint16", 2, as_double<uint16_t>},
    {"int", "int32", 4, as_double<int32_t>},   {"uint", "uint32", 4, as_double<uint32_t>},
    {"float", "float32", 4, as_double<float>}, {"double", "float64", 8, as_double<double>}};
/// In the order of PlyTable::Format.
constexpr std::string_view kFormats[] = {"ascii", "binary_little_endian", "binary_big_endian"};

size_t bytes_of(PlyType type) {
    return kTypes[size_t(type)].bytes;
}

}  // namespace

bool PlyElement::has_lists() const {
    return std::any_of(properties.begin(), properties.end(),
                       [](const PlyProperty& p) { return p.list_count; });
}

size_t PlyElement::row_bytes() const {
    size_t bytes = 0;
    for (const PlyProperty& property : properties)
        bytes += bytes_of(property.list_count.value_or(property.type));
    return bytes;
}

std::optional<size_t> PlyElement::find(std::string_view property) const {
    const auto found = std::ranges::find(properties, property, &PlyProperty::name);
    if (found == properties.end()) return std::nullopt;
    return size_t(found - properties.begin());
}

std::optional<size_t> PlyElement::find_number(std::string_view property) const {
    const std::optional<size_t> found = find(property);
    return found && !properties[*found].list_count ? found : std::nullopt;
}

std::optional<PlyColors> find_colors(const std::filesystem::path& path, const PlyElement& element) {
    constexpr std::array<std::array<std::string_view, 3>, 3> kNames = {
        {{"red", "green", "blue"}, {"diffuse_red", "diffuse_green", "diffuse_blue"}, {"r", "g", "b"}}};
    for (const auto& names : kNames) {
        PlyColors colors;
        size_t found = 0;
        for (size_t k = 0; k < 3; ++k)
            for (size_t p = 0; p < element.properties.size(); ++p)
                if (!element.properties[p].list_count &&
                    core::lower(element.properties[p].name) == names[k]) {
                    colors.columns[k] = p;
                    ++found;
                    break;
                }
        if (found < 3) continue;
        const PlyType type = element.properties[colors.columns[0]].type;
        if (type == PlyType::int8 || type == PlyType::uint8) return colors;
        // Some programs let bytes run over a little. 16 bits have at least one value far beyond.
        constexpr double kMostOfBytes = 1023;
        double largest = 0;
        PlyTable table(path);
        table.go_to(element.name);
        table.read({colors.columns.begin(), colors.columns.end()}, [&](size_t, const double* row) {
            for (size_t k = 0; k < 3; ++k)
                if (std::isfinite(row[k])) largest = std::max(largest, row[k]);
        });
        const bool real = type == PlyType::float32 || type == PlyType::float64;
        colors.full = real && largest <= 1 ? 1 : largest <= kMostOfBytes ? 255 : 65535;
        return colors;
    }
    return std::nullopt;
}

PlyTable::PlyTable(const std::filesystem::path& path) : reader_(path) {
    parse_header();
}

void PlyTable::parse_header() {
    std::string line;
    // Checked before a line is read: the first line of another kind of file may have any length.
    const auto begins = [&](const char* bytes) {
        return reader_.remaining() >= 4 && std::memcmp(reader_.take(3, "the header"), bytes, 3) == 0;
    };
    const uint64_t begin = reader_.offset();
    if (!begins("\xEF\xBB\xBF")) reader_.go_to(begin, "the header");  // a byte order mark, of a text editor
    if (!begins("ply")) fail("this is not a PLY file (it does not start with \"ply\")");
    if (!reader_.read_line(line, kMaxHeaderLine) || !core::trim(line).empty())
        fail("this is not a PLY file (the first line is not \"ply\")");
    bool has_format = false;
    while (reader_.read_line(line, kMaxHeaderLine)) {
        if (reader_.offset() > kMaxHeaderBytes) fail("the header is longer than 4 MiB; it is damaged");
        std::string_view rest = line;
        const std::string_view keyword = core::next_word(rest);
        if (keyword == "end_header") {
            if (!has_format) fail("the header has no \"format\" line");
            return;
        }
        if (keyword == "format") {
            parse_format(rest);
            has_format = true;
        } else if (keyword == "comment") {
            comments_.emplace_back(core::trim(rest));
        } else if (keyword == "element") {
            parse_element(rest);
        } else if (keyword == "property") {
            parse_property(rest);
        } else if (keyword != "obj_info" && !keyword.empty()) {
            fail("the header line " + shown_word(line) + " is unknown in PLY");
        }
    }
    fail("the file ends inside the header (there is no \"end_header\")");
}

void PlyTable::parse_format(std::string_view rest) {
    const std::string_view format = core::next_word(rest);
    const auto* found = std::ranges::find(kFormats, format);
    if (found == std::end(kFormats)) fail("the format " + shown_word(format) + " is unknown in PLY");
    format_ = Format(found - kFormats);
}

std::string_view PlyTable::format_name() const {
    return kFormats[size_t(format_)];
}

void PlyTable::parse_element(std::string_view rest) {
    PlyElement element;
    element.name = core::next_word(rest);
    const std::string_view count = core::next_word(rest);
    const std::optional<uint64_t> parsed = core::parse_integer<uint64_t>(count);
    if (element.name.empty() || !parsed)
        fail("an element needs a name and a count of 0 or more, not " + shown_word(count));
    element.count = *parsed;
    elements_.push_back(std::move(element));
}

void PlyTable::parse_property(std::string_view rest) {
    if (elements_.empty()) fail("a property precedes the first element");
    PlyElement& element = elements_.back();
    const auto next_type = [&] {
        const std::string_view word = core::next_word(rest);
        const auto* found = std::ranges::find_if(
            kTypes, [&](const TypeInfo& type) { return word == type.plain || word == type.sized; });
        if (found == std::end(kTypes)) fail("the property type " + shown_word(word) + " is unknown in PLY");
        return PlyType(found - kTypes);
    };
    PlyProperty property;
    property.offset = element.row_bytes();
    std::string_view peek = rest;
    if (core::next_word(peek) == "list") {
        rest = peek;
        property.list_count = next_type();
        if (*property.list_count == PlyType::float32 || *property.list_count == PlyType::float64)
            fail("a list's length cannot be a floating-point number");
    }
    property.type = next_type();
    property.name = core::next_word(rest);
    if (property.name.empty()) fail("a property has no name");
    if (element.properties.size() == kMaxProperties)
        fail("the element " + shown_word(element.name) + " has more than " + std::to_string(kMaxProperties) +
             " properties; the file is damaged");
    if (element.find(property.name)) fail("the property " + shown_word(property.name) + " is declared twice");
    element.properties.push_back(std::move(property));
}

const PlyElement& PlyTable::go_to(std::string_view name) {
    for (; next_element_ < elements_.size(); ++next_element_) {
        const PlyElement& element = elements_[next_element_];
        // The shortest row of text is one digit and one separator per value. The last separator may be
        // missing.
        const uint64_t columns = element.properties.size();
        const uint64_t least =
            format_ == Format::ascii ? std::max<uint64_t>(2 * columns, 1) - 1 : element.row_bytes();
        reader_.require_room(element.count, least, "rows of \"" + element.name + "\"");
        if (element.name == name) return element;
        skip_rows(element);
    }
    fail("the header declares no element \"" + std::string(name) + "\"");
}

void PlyTable::skip_rows(const PlyElement& element) {
    if (element.properties.empty()) return;
    if (format_ != Format::ascii && !element.has_lists()) {
        reader_.skip(element.count * element.row_bytes(), "the rows of \"" + element.name + "\"");
        return;
    }
    std::vector<double> values(element.properties.size());
    for (uint64_t i = 0; i < element.count; ++i) read_row(element, values);
}

void PlyTable::read(const std::vector<size_t>& columns,
                    const std::function<void(size_t, const double*)>& row) {
    const PlyElement& element = elements_[next_element_++];
    std::vector<double> values(columns.size()), all(element.properties.size());
    const bool fixed = format_ != Format::ascii && !element.has_lists();
    const size_t bytes = element.row_bytes();
    const std::string what = "a row of \"" + element.name + "\"";
    for (uint64_t i = 0; i < element.count; ++i) {
        if (fixed) {
            const std::byte* start = reader_.take(bytes, what);
            for (size_t c = 0; c < columns.size(); ++c) {
                const PlyProperty& property = element.properties[columns[c]];
                values[c] = decode(property.type, start + property.offset);
            }
        } else {
            read_row(element, all);
            for (size_t c = 0; c < columns.size(); ++c) values[c] = all[columns[c]];
        }
        row(static_cast<size_t>(i), values.data());
    }
}

void PlyTable::read_lists(size_t list, const std::function<void(std::span<const double>)>& row) {
    const PlyElement& element = elements_[next_element_++];
    std::vector<double> all(element.properties.size()), kept;
    for (uint64_t i = 0; i < element.count; ++i) {
        read_row(element, all, list, &kept);
        row(kept);
    }
}

void PlyTable::read_row(const PlyElement& element, std::vector<double>& values, std::optional<size_t> keep,
                        std::vector<double>* kept) {
    for (size_t p = 0; p < element.properties.size(); ++p) {
        const PlyProperty& property = element.properties[p];
        if (!property.list_count) {
            values[p] = read_value(property.type, property.name);
            continue;
        }
        const uint64_t count = read_list_count(property);
        values[p] = static_cast<double>(count);
        read_list_values(property, count, keep == p ? kept : nullptr);
    }
}

void PlyTable::read_list_values(const PlyProperty& property, uint64_t count, std::vector<double>* kept) {
    const size_t bytes = bytes_of(property.type);
    if (!kept && format_ != Format::ascii)
        return reader_.skip(count * bytes, "the list \"" + property.name + "\"");
    if (kept) {
        // The last value of a text may lack its separator.
        reader_.require_room(format_ == Format::ascii ? 2 * std::max<uint64_t>(count, 1) - 1 : count,
                             format_ == Format::ascii ? 1 : bytes, "values of \"" + property.name + "\"");
        kept->clear();
    }
    for (uint64_t i = 0; i < count; ++i) {
        const double value = read_value(property.type, property.name);
        if (kept) kept->push_back(value);
    }
}

uint64_t PlyTable::read_list_count(const PlyProperty& property) {
    const double count = read_value(*property.list_count, property.name);
    if (!(count >= 0) || count > 4294967295.0 || count != std::floor(count))
        fail("the list " + shown_word(property.name) + " has an invalid length");
    return static_cast<uint64_t>(count);
}

double PlyTable::read_value(PlyType type, std::string_view what) {
    if (format_ == Format::ascii) return read_ascii_value(what);
    return decode(type, reader_.take(bytes_of(type), what));
}

double PlyTable::read_ascii_value(std::string_view what) {
    const auto blank = [](char c) { return c == ' ' || c == '\t' || c == '\r' || c == '\n'; };
    char c = reader_.read<char>(what);
    while (blank(c)) c = reader_.read<char>(what);
    std::string word;
    while (!blank(c)) {
        word += c;
        if (word.size() > kMaxWord)
            fail("a number is longer than " + std::to_string(kMaxWord) + " characters");
        if (reader_.remaining() == 0) break;
        c = reader_.read<char>(what);
    }
    const std::optional<double> value = core::parse_number(word);
    if (!value) fail("\"" + word + "\" is not a number (" + std::string(what) + ")");
    return *value;
}

double PlyTable::decode(PlyType type, const std::byte* bytes) const {
    std::byte swapped[8];
    if (format_ == Format::big_endian) {
        std::reverse_copy(bytes, bytes + bytes_of(type), swapped);
        bytes = swapped;
    }
    return kTypes[size_t(type)].read(bytes);
}

}  // namespace ewa::io
