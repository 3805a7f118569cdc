// SPDX-License-Identifier: Apache-2.0
// What the two files of RealityScan (once RealityCapture) have in common: a calibration in units of the image's larger side.
#pragma once
#include <array>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "io/datasets/image_records.h"

namespace ewa::io {

/// The columns that a table of cameras must have, by RealityScan's names.
inline constexpr std::array kCsvColumns{"name", "x", "y", "alt", "heading", "pitch", "roll", "f"};

/// Indices of the columns, by RealityScan's names.
using CsvColumns = std::map<std::string, size_t>;

/// The line of a table that names its columns: the first one with a comma, a semicolon or a tabulator. A line "#cameras N" may be
/// before it.
std::string_view reality_scan_heading(std::string_view head);

/// Other spellings, such as yaw for heading, have RealityScan's names. A name may occur twice: the first one counts.
CsvColumns reality_scan_columns(std::string_view heading);

struct RealityScanCalibration {
    double focal = 0;     // mm on film of 36 mm along the larger side
    double u = 0, v = 0;  // of the principal point, from the middle, over the larger side
    /// k1, k2, k3, k4, t1, t2. The radial ones are of r^2, r^4, r^6 and r^8; t1 and t2 are OpenCV's p2 and p1.
    std::vector<double> terms;
    /// p 2 / (1 + sqrt(1 - 4 k1 |p|^2)) with the first term as k1, as in COLMAP.
    bool division = false;
};

/// Sets camera and distortion. The size is the image file's; without the file it stays 0.
void set_calibration(ImageRecord& record, const RealityScanCalibration& calibration,
                     const std::string& where);

}  // namespace ewa::io
