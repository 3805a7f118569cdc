// SPDX-License-Identifier: Apache-2.0
#include "io/splats/ply_table.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "core/text.h"

namespace ewa::io {

namespace {

constexpr size_t kMaxHeaderLine = size_t(1) << 16;
constexpr uint64_t kMaxHeaderBytes = uint64_t(1) << 22;
constexpr size_t kMaxProperties = 1024;  // per element; each is compared with all before it
constexpr size_t kMaxWord = 512;         // longer than any number that a program writes

std::optional<PlyType> type_of(std::string_view name) {
    struct Name {
        std::string_view plain, sized;
        PlyType type;
    };
    static constexpr Name kNames[] = {
        {"char", "int8", PlyType::int8},        {"uchar", "uint8", PlyType::uint8},
        {"short", "int16", PlyType::int16},     {"ushort", "uint16", PlyType::uint16},
        {"int", "int32", PlyType::int32},       {"uint", "uint32", PlyType::uint32},
        {"float", "float32", PlyType::float32}, {"double", "float64", PlyType::float64}};
    for (const Name& entry : kNames)
        if (name == entry.plain || name == entry.sized) return entry.type;
    return std::nullopt;
}

size_t bytes_of(PlyType type) {
    switch (type) {
        case PlyType::int8:
        case PlyType::uint8:
            return 1;
        case PlyType::int16:
        case PlyType::uint16:
            return 2;
        case PlyType::int32:
        case PlyType::uint32:
        case PlyType::float32:
            return 4;
        case PlyType::float64:
            return 8;
    }
    return 8;
}

template <class T>
double as_double(const std::byte* bytes) {
    T value;
    std::memcpy(&value, bytes, sizeof(T));
    return static_cast<double>(value);
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
    for (size_t i = 0; i < properties.size(); ++i)
        if (properties[i].name == property) return i;
    return std::nullopt;
}

PlyTable::PlyTable(const std::filesystem::path& path) : reader_(path) {
    parse_header();
}

void PlyTable::parse_header() {
    std::string line;
    // Checked before a line is read: the first line of another kind of file may have any length.
    if (reader_.remaining() < 4 || std::memcmp(reader_.take(3, "the header"), "ply", 3) != 0)
        fail("this is not a PLY file (it does not start with \"ply\")");
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
            fail("the header line \"" + line.substr(0, 60) + "\" is unknown in PLY");
        }
    }
    fail("the file ends inside the header (there is no \"end_header\")");
}

void PlyTable::parse_format(std::string_view rest) {
    const std::string_view format = core::next_word(rest);
    if (format == "ascii")
        format_ = Format::ascii;
    else if (format == "binary_little_endian")
        format_ = Format::little_endian;
    else if (format == "binary_big_endian")
        format_ = Format::big_endian;
    else
        fail("the format \"" + std::string(format) + "\" is unknown in PLY");
}

std::string_view PlyTable::format_name() const {
    switch (format_) {
        case Format::ascii:
            return "ascii";
        case Format::little_endian:
            return "binary_little_endian";
        case Format::big_endian:
            return "binary_big_endian";
    }
    return "";
}

void PlyTable::parse_element(std::string_view rest) {
    PlyElement element;
    element.name = core::next_word(rest);
    const std::string_view count = core::next_word(rest);
    const std::optional<uint64_t> parsed = core::parse_integer<uint64_t>(count);
    if (element.name.empty() || !parsed)
        fail("an element needs a name and a count of 0 or more, not \"" + std::string(count) + "\"");
    element.count = *parsed;
    elements_.push_back(std::move(element));
}

void PlyTable::parse_property(std::string_view rest) {
    if (elements_.empty()) fail("a property precedes the first element");
    PlyElement& element = elements_.back();
    const auto next_type = [&] {
        const std::string_view word = core::next_word(rest);
        const std::optional<PlyType> type = type_of(word);
        if (!type) fail("the property type \"" + std::string(word) + "\" is unknown in PLY");
        return *type;
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
        fail("the element \"" + element.name + "\" has more than " + std::to_string(kMaxProperties) +
             " properties; the file is damaged");
    if (element.find(property.name)) fail("the property \"" + property.name + "\" is declared twice");
    element.properties.push_back(std::move(property));
}

void PlyTable::check_room(const PlyElement& element) const {
    // The shortest row of text is one digit and one separator per value. The last separator may be missing.
    const uint64_t columns = element.properties.size();
    const uint64_t least =
        format_ == Format::ascii ? std::max<uint64_t>(2 * columns, 1) - 1 : element.row_bytes();
    reader_.require_room(element.count, least, "rows of \"" + element.name + "\"");
}

const PlyElement& PlyTable::go_to(std::string_view name) {
    for (; next_element_ < elements_.size(); ++next_element_) {
        const PlyElement& element = elements_[next_element_];
        check_room(element);
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

void PlyTable::read_row(const PlyElement& element, std::vector<double>& values) {
    for (size_t p = 0; p < element.properties.size(); ++p) {
        const PlyProperty& property = element.properties[p];
        if (!property.list_count) {
            values[p] = read_value(property.type, property.name);
            continue;
        }
        const uint64_t count = read_list_count(property);
        values[p] = static_cast<double>(count);
        if (format_ == Format::ascii)
            for (uint64_t i = 0; i < count; ++i) read_ascii_value(property.name);
        else
            reader_.skip(count * bytes_of(property.type), "the list \"" + property.name + "\"");
    }
}

uint64_t PlyTable::read_list_count(const PlyProperty& property) {
    const double count = read_value(*property.list_count, property.name);
    if (!(count >= 0) || count > 4294967295.0 || count != std::floor(count))
        fail("the list \"" + property.name + "\" has an invalid length");
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
    switch (type) {
        case PlyType::int8:
            return as_double<int8_t>(bytes);
        case PlyType::uint8:
            return as_double<uint8_t>(bytes);
        case PlyType::int16:
            return as_double<int16_t>(bytes);
        case PlyType::uint16:
            return as_double<uint16_t>(bytes);
        case PlyType::int32:
            return as_double<int32_t>(bytes);
        case PlyType::uint32:
            return as_double<uint32_t>(bytes);
        case PlyType::float32:
            return as_double<float>(bytes);
        case PlyType::float64:
            return as_double<double>(bytes);
    }
    return 0;
}

}  // namespace ewa::io
