// SPDX-License-Identifier: Apache-2.0
// The table "Internal/External camera parameters" of RealityScan (once RealityCapture), a CSV file.
//
// #name,x,y,alt,heading,pitch,roll,f,px,py,k1,k2,k3,k4,t1,t2 in any order; what follows roll may be missing, but for f. Without a comma between columns, numbers may have decimal commas. A line
// "#cameras N" may be before it, and yaw stand for heading.
// The camera (x right, y up, z back) is turned by Rz(-heading) Rx(pitch) Ry(roll), in degrees: without turns it looks straight down,
// and z is up. RealityScanCalibration has the other units.
#include <algorithm>
#include <cmath>
#include <glm/gtc/quaternion.hpp>
#include <map>
#include <string_view>

#include "core/file_reader.h"
#include "core/text.h"
#include "ewa/error.h"
#include "io/datasets/importers/image_finder.h"
#include "io/datasets/importers/importer.h"
#include "io/datasets/importers/reality_scan.h"
#include "io/datasets/rotation.h"

namespace ewa::io {

namespace {

constexpr size_t kLongestRow = 1 << 16, kMostRows = 1000000;

/// Cells between separators, with or without quotation marks around one.
std::vector<std::string> cells_of(std::string_view line, char separator) {
    std::vector<std::string> cells(1);
    bool quoted = false;
    for (const char c : line) {
        if (c == '"')
            quoted = !quoted;
        else if (c == separator && !quoted)
            cells.emplace_back();
        else
            cells.back() += c;
    }
    for (std::string& cell : cells) cell = std::string(core::trim(cell));
    return cells;
}

/// A row with the columns that the first line names.
struct CsvRow {
    const CsvColumns& columns;
    std::vector<std::string> cells;
    std::string where;
    bool commas = false;  // whether numbers may have decimal commas

    [[noreturn]] void fail(const std::string& text) const {
        throw InputError(where + ": " + core::one_line(text));
    }
    double number(const char* column) const {
        std::string cell = cells[columns.at(column)];
        if (commas && std::ranges::count(cell, ',') == 1) std::ranges::replace(cell, ',', '.');
        const std::optional<double> value = core::parse_number(cell);
        if (!value || !std::isfinite(*value))
            fail(std::string(column) + ": \"" + cell.substr(0, 60) + "\" is not a finite number");
        return *value;
    }
    double number(const char* column, double absent) const {
        return columns.contains(column) ? number(column) : absent;
    }
};

constexpr std::string_view kSeparators = ",;\t";

/// The first of kSeparators in the line.
char separator_in(std::string_view line) {
    return line[std::min(line.find_first_of(kSeparators), line.size() - 1)];
}

glm::dmat3 turned(const glm::dvec3& axis, double degrees) {
    return glm::mat3_cast(glm::angleAxis(glm::radians(degrees), axis));
}

ImageRecord record_of(const CsvRow& row, const ImageFinder& images) {
    ImageRecord record;
    const std::string& name = row.cells[row.columns.at("name")];
    images.find(name, row.where, record);
    set_calibration(record,
                    {.focal = row.number("f"),
                     .u = row.number("px", 0),
                     .v = row.number("py", 0),
                     .terms = {row.number("k1", 0), row.number("k2", 0), row.number("k3", 0),
                               row.number("k4", 0), row.number("t1", 0), row.number("t2", 0)}},
                    row.where);
    const glm::dmat3 axes = turned({0, 0, 1}, -row.number("heading")) *
                            turned({1, 0, 0}, row.number("pitch")) * turned({0, 1, 0}, row.number("roll"));
    set_pose(record.camera, from_opengl(axes), {row.number("x"), row.number("y"), row.number("alt")});
    finish_record(record, row.where);
    return record;
}

}  // namespace

std::string_view reality_scan_heading(std::string_view head) {
    for (size_t begin = 0, end = 0; begin < head.size(); begin = end + 1) {
        end = std::min(head.find('\n', begin), head.size());
        const std::string_view line = core::trim(head.substr(begin, end - begin));
        if (line.find_first_of(kSeparators) != line.npos) return line;
    }
    return {};
}

CsvColumns reality_scan_columns(std::string_view heading) {
    static const std::map<std::string, std::string> kOther{
        {"yaw", "heading"}, {"z", "alt"},         {"altitude", "alt"},  {"label", "name"},
        {"image", "name"},  {"filename", "name"}, {"imagename", "name"}};
    CsvColumns columns;
    if (heading.empty()) return columns;
    const std::vector<std::string> cells = cells_of(heading, separator_in(heading));
    for (size_t i = 0; i < cells.size(); ++i) {
        const size_t begin = std::min(cells[i].find_first_not_of("#\xef\xbb\xbf "), cells[i].size());
        const std::string name = core::lower(cells[i].substr(begin));
        const auto other = kOther.find(name);
        columns.emplace(other == kOther.end() ? name : other->second, i);
    }
    return columns;
}

ImageRecords import_reality_scan_csv(const ImportSource& source) {
    core::FileReader reader(source.file);
    std::string line;
    CsvColumns columns;
    size_t width = 0;
    char separator = ',';
    const ImageFinder images(source.dataset, {"images"});
    ImageRecords records = begin_records(source, "RealityScan", images.folder());
    for (size_t number = 1; reader.read_line(line, kLongestRow); ++number) {
        const std::string where = reader.name() + ":" + std::to_string(number);
        if (core::trim(line).empty()) continue;
        if (number > kMostRows) throw InputError(where + ": has more than 1000000 rows");
        if (columns.empty()) {
            if (reality_scan_heading(line).empty()) continue;
            separator = separator_in(line);
            width = cells_of(line, separator).size();
            columns = reality_scan_columns(line);
            for (const char* column : kCsvColumns)
                if (!columns.contains(column))
                    throw InputError(
                        where + ": the column " + column +
                        " is missing; export the format \"Internal/External camera parameters\"");
            continue;
        }
        if (line.starts_with("#")) continue;
        const CsvRow row{columns, cells_of(line, separator), where, separator != ','};
        if (row.cells.size() < width)
            row.fail("has " + std::to_string(row.cells.size()) + " of " + std::to_string(width) + " values");
        records.images.push_back(record_of(row, images));
    }
    add_points_beside(source.dataset, source.with_points, records);
    return records;
}

}  // namespace ewa::io
