// SPDX-License-Identifier: Apache-2.0
// The content of a dataset's model file, before any image is read. The reader of each format returns these
// types.
#pragma once
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "ewa/dataset.h"

namespace ewa::io {

/// One image of the model. The image file may not exist.
struct ImageRecord {
    std::string name;            // Frame::name
    std::filesystem::path path;  // of the image
    Camera camera;               // OpenCV axes; width and height are 0 if neither model nor image states them
    std::filesystem::path mask;  // the mask that the model names; empty: none
    Distortion distortion;
    int split = 0;  // Frame::split
};

/// Points that are skipped: float32, in which splats are stored, cannot hold a coordinate as a finite number.
struct DroppedPoints {
    int count = 0;
    std::string first;  // file and byte, line or vertex of the first one
};

struct PlyPoints {
    PointCloud points;
    DroppedPoints dropped;
};

struct ImageRecords {
    std::filesystem::path folder;     // of the images; images_2 and so on beside it hold smaller copies
    std::vector<ImageRecord> images;  // in the order of the file
    PointCloud points;
    DroppedPoints dropped;
    bool color_depends_on_view = true;  // Dataset::color_depends_on_view
};

/// Adds a point, or counts it as dropped. `where` is called for the first dropped point.
void add_point(PointCloud& points, DroppedPoints& dropped, const glm::dvec3& position,
               const std::array<uint8_t, 3>& color, const std::function<std::string()>& where);

/// Reads the vertices of a PLY: x y z, in the frame of the file. Colours are red green blue, as integers
/// 0..255 or floating-point numbers 0..1. Without colours, points are mid-grey. Throws InputError that names
/// the file and the byte or property.
PlyPoints read_points_ply(const std::filesystem::path& path);

/// Writes a binary PLY of x y z (float32) and red green blue (8 bits). Throws RunError.
void write_points_ply(const std::filesystem::path& path, const PointCloud& points);

}  // namespace ewa::io
