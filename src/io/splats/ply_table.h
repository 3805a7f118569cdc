// SPDX-License-Identifier: Apache-2.0
// The PLY container (Turk 1994): a text header that declares elements and their properties, then their rows.
// What the properties mean is the business of ply.h and points_ply.h.
#pragma once
#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/file_reader.h"

namespace ewa::io {

enum class PlyType { int8, uint8, int16, uint16, int32, uint32, float32, float64 };

struct PlyProperty {
    std::string name;
    PlyType type = PlyType::float32;    // of the value, or of each of a list's values
    std::optional<PlyType> list_count;  // there for a list
    size_t offset = 0;                  // in a binary row of an element without lists
};

struct PlyElement {
    std::string name;
    uint64_t count = 0;  // as claimed
    std::vector<PlyProperty> properties;

    bool has_lists() const;
    size_t row_bytes() const;  // of a binary row whose lists are all empty
    std::optional<size_t> find(std::string_view property) const;
};

/// ascii, binary_little_endian and binary_big_endian. Throws InputError that names the byte.
class PlyTable {
  public:
    explicit PlyTable(const std::filesystem::path& path);

    const std::string& name() const { return reader_.name(); }
    uint64_t file_bytes() const { return reader_.size(); }
    const std::vector<PlyElement>& elements() const { return elements_; }
    const std::vector<std::string>& comments() const { return comments_; }
    /// As the header calls it, e.g. "ascii".
    std::string_view format_name() const;

    /// The element, after checking that the file is long enough for the rows that the header claims: from
    /// here on memory may be taken for count rows. Throws where there is no such element. Elements before it
    /// are skipped.
    const PlyElement& go_to(std::string_view element);

    /// The rows of the element gone to, in order: row(index, values), values in the order of `columns`
    /// (indices of properties that are no lists). A property's value is converted to double, which holds
    /// every PLY type exactly.
    void read(const std::vector<size_t>& columns, const std::function<void(size_t, const double*)>& row);

    [[noreturn]] void fail(std::string_view text) const { reader_.fail(text); }

  private:
    enum class Format { ascii, little_endian, big_endian };

    void parse_header();
    void parse_format(std::string_view rest);
    void parse_element(std::string_view rest);
    void parse_property(std::string_view rest);
    void check_room(const PlyElement& element) const;
    void skip_rows(const PlyElement& element);
    void read_row(const PlyElement& element, std::vector<double>& values);  // a list's value is its length
    double read_value(PlyType type, std::string_view what);
    uint64_t read_list_count(const PlyProperty& property);
    double read_ascii_value(std::string_view what);
    double decode(PlyType type, const std::byte* bytes) const;

    core::FileReader reader_;
    Format format_ = Format::ascii;
    std::vector<PlyElement> elements_;
    std::vector<std::string> comments_;
    size_t next_element_ = 0;  // the one whose rows come next in the file
};

}  // namespace ewa::io
