// SPDX-License-Identifier: Apache-2.0
// The table "Internal/External camera parameters" of RealityScan (once RealityCapture), a CSV file.
//
// #name,x,y,alt,heading,pitch,roll,f,px,py,k1,k2,k3,k4,t1,t2 in any order; what follows roll may be missing, but for f.
// The camera (x right, y up, z back) is turned by Rz(-heading) Rx(pitch) Ry(roll), in degrees: without turns it looks straight down,
// and z is up. RealityScanCalibration has the other units.
#include <cmath>
#include <glm/gtc/quaternion.hpp>
#include <map>

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

/// Cells between commas, with or without quotation marks around one.
std::vector<std::string> cells_of(std::string_view line) {
    std::vector<std::string> cells(1);
    bool quoted = false;
    for (const char c : line) {
        if (c == '"')
            quoted = !quoted;
        else if (c == ',' && !quoted)
            cells.emplace_back();
        else
            cells.back() += c;
    }
    for (std::string& cell : cells) cell = std::string(core::trim(cell));
    return cells;
}

/// A row with the columns that the first line names.
struct CsvRow {
    const std::map<std::string, size_t>& columns;
    std::vector<std::string> cells;
    std::string where;

    [[noreturn]] void fail(const std::string& text) const {
        throw InputError(where + ": " + core::one_line(text));
    }
    double number(const char* column) const {
        const std::string& cell = cells[columns.at(column)];
        const std::optional<double> value = core::parse_number(cell);
        if (!value || !std::isfinite(*value))
            fail(std::string(column) + ": \"" + cell.substr(0, 60) + "\" is not a finite number");
        return *value;
    }
    double number(const char* column, double absent) const {
        return columns.contains(column) ? number(column) : absent;
    }
};

glm::dmat3 turned(const glm::dvec3& axis, double degrees) {
    return glm::mat3_cast(glm::angleAxis(glm::radians(degrees), axis));
}

ImageRecord record_of(const CsvRow& row, const ImageFinder& images) {
    ImageRecord record;
    const std::string& name = row.cells[row.columns.at("name")];
    const auto found = images.find(name, row.where);
    record.name = found.name;
    record.path = found.path;
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

ImageRecords import_reality_scan_csv(const ImportSource& source) {
    core::FileReader reader(source.file);
    std::string line;
    std::map<std::string, size_t> columns;  // a name may occur twice: the first one counts
    size_t width = 0;
    ImageRecords records;
    records.program = "RealityScan";
    records.files = {source.file};
    const ImageFinder images(source.dataset, {"images"});
    records.folder = images.folder();
    for (size_t number = 1; reader.read_line(line, kLongestRow); ++number) {
        const std::string where = reader.name() + ":" + std::to_string(number);
        constexpr std::string_view kByteOrderMark = "\xef\xbb\xbf";
        if (number == 1 && line.starts_with(kByteOrderMark)) line.erase(0, kByteOrderMark.size());
        if (core::trim(line).empty()) continue;
        if (number > kMostRows) throw InputError(where + ": has more than 1000000 rows");
        std::vector<std::string> cells = cells_of(line);
        if (columns.empty()) {
            if (cells[0].starts_with("#")) cells[0].erase(0, 1);
            width = cells.size();
            for (size_t i = 0; i < width; ++i) columns.emplace(cells[i], i);
            for (const char* column : {"name", "x", "y", "alt", "heading", "pitch", "roll", "f"})
                if (!columns.contains(column))
                    throw InputError(
                        where + ": the column " + column +
                        " is missing; export the format \"Internal/External camera parameters\"");
            continue;
        }
        if (line.starts_with("#")) continue;
        const CsvRow row{columns, cells, where};
        if (cells.size() < width)
            row.fail("has " + std::to_string(cells.size()) + " of " + std::to_string(width) + " values");
        records.images.push_back(record_of(row, images));
    }
    add_points_beside(source.dataset, source.with_points, records);
    return records;
}

}  // namespace ewa::io
