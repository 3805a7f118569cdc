// SPDX-License-Identifier: Apache-2.0
// The place of a scene on the globe: in a dataset's place.json, and in a comment of a PLY ("ewa place LATITUDE LONGITUDE HEIGHT").
// Both are of the world's origin, where x points east, y down and z north, in metres. Numbers have all digits of a double.
#pragma once
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace ewa::io {

inline constexpr const char* kPlaceFile = "place.json";

/// A place on the globe: degrees of WGS 84, and metres above the ellipsoid. Heights by EXIF are above the sea. heading: of the scene's z axis, clockwise from north.
struct Place {
    double latitude = 0, longitude = 0, height = 0, heading = 0;
};

/// The place of the dataset in a folder; empty if it has none. A file that write_place has not written, or a damaged one, is none.
std::optional<Place> read_place(const std::filesystem::path& folder);
/// Throws RunError.
void write_place(const std::filesystem::path& file, const Place& place);

/// The comment of a PLY that states the place. It has no heading, which counts as 0.
std::string place_comment(const Place& place);
bool is_place_comment(const std::string& comment);
/// The place that the comments of a PLY name. Empty if they name none, or several that differ.
std::optional<Place> place_in(const std::vector<std::string>& comments);

}  // namespace ewa::io
