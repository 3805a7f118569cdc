// What a dataset's model file says, before its pictures are looked at. Each format's reader makes one of
// these.
#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "ewa/dataset.h"

namespace ewa::io {

struct PosedImage {
    std::string name;            // Frame::name
    std::filesystem::path path;  // of the picture, which may not exist
    Camera camera;               // OpenCV axes; width and height 0 where neither model nor picture tells
    Distortion distortion;
    int split = 0;  // Frame::split
};

struct PosedImages {
    std::vector<PosedImage> images;  // in the file's order
    PointCloud points;
    int dropped_points = 0;
};

/// Adds a point, or counts it as dropped when float32, which splats are stored in, cannot hold it as finite
/// numbers.
void add_point(PointCloud& points, int& dropped, const glm::dvec3& position,
               const std::array<uint8_t, 3>& color);

}  // namespace ewa::io
