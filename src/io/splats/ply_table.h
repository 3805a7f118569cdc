// SPDX-License-Identifier: Apache-2.0
// The PLY container (Turk 1994): a text header declares elements and their properties, and their rows follow.
// ply.cpp, compressed_ply.cpp, datasets/image_records.cpp and meshes/ply_mesh.cpp interpret the properties.
#pragma once
#include <array>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/file_reader.h"

namespace ewa::io {

enum class PlyType { int8, uint8, int16, uint16, int32, uint32, float32, float64 };

struct PlyProperty {
    std::string name;
    PlyType type = PlyType::float32;    // of the value, or of each value of a list
    std::optional<PlyType> list_count;  // type of a list's length; empty if the property is not a list
    size_t offset = 0;                  // in a binary row of an element without lists
};

struct PlyElement {
    std::string name;
    uint64_t count = 0;  // as the header claims
    std::vector<PlyProperty> properties;

    bool has_lists() const;
    size_t row_bytes() const;  // of a binary row with empty lists
    std::optional<size_t> find(std::string_view property) const;
    std::optional<size_t> find_number(std::string_view property) const;  // not a list
};

/// The columns of an element that hold red, green and blue.
struct PlyColors {
    std::array<size_t, 3> columns{};
    double full = 255;  // the value of full brightness
};

/// The colours under one of the names that programs give them, such as red and diffuse_red. Empty unless all three are numbers.
/// Unless they have 8 bits, the whole file is read for the largest value, which tells floats to 1 from those to 255, and
/// 16 bits from 8 in a wider type.
std::optional<PlyColors> find_colors(const std::filesystem::path& path, const PlyElement& element);

/// Reads ascii, binary_little_endian and binary_big_endian. Throws InputError that names the byte.
class PlyTable {
  public:
    explicit PlyTable(const std::filesystem::path& path);

    const std::string& name() const { return reader_.name(); }
    uint64_t file_bytes() const { return reader_.size(); }
    const std::vector<PlyElement>& elements() const { return elements_; }
    const std::vector<std::string>& comments() const { return comments_; }
    /// The format's name in the header, e.g. "ascii".
    std::string_view format_name() const;

    /// Skips to an element and checks that the file is long enough for the rows that its header claims. So
    /// the caller may allocate memory for count rows. Throws if there is no such element.
    const PlyElement& go_to(std::string_view element);

    /// Calls row(index, values) for each row of that element, in order. The values follow `columns`, the
    /// indices of properties that are not lists. Double holds every PLY type exactly.
    void read(const std::vector<size_t>& columns, const std::function<void(size_t, const double*)>& row);

    /// Reads one property that is a list: calls row with the values of property `list`, for each row of the element.
    void read_lists(size_t list, const std::function<void(std::span<const double>)>& row);

    [[noreturn]] void fail(std::string_view text) const { reader_.fail(text); }

  private:
    enum class Format { ascii, little_endian, big_endian };

    void parse_header();
    void parse_format(std::string_view rest);
    void parse_element(std::string_view rest);
    void parse_property(std::string_view rest);
    void skip_rows(const PlyElement& element);
    /// The value of a list is its length. kept: gets the values of the list `keep`.
    void read_row(const PlyElement& element, std::vector<double>& values,
                  std::optional<size_t> keep = std::nullopt, std::vector<double>* kept = nullptr);
    void read_list_values(const PlyProperty& property, uint64_t count, std::vector<double>* kept);
    double read_value(PlyType type, std::string_view what);
    uint64_t read_list_count(const PlyProperty& property);
    double read_ascii_value(std::string_view what);
    double decode(PlyType type, const std::byte* bytes) const;

    core::FileReader reader_;
    Format format_ = Format::ascii;
    std::vector<PlyElement> elements_;
    std::vector<std::string> comments_;
    size_t next_element_ = 0;  // the element whose rows come next in the file
};

}  // namespace ewa::io
