// SPDX-License-Identifier: Apache-2.0
// What a dataset's model file says, before its pictures are looked at. Each format's reader makes one of
// these.
#pragma once
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "ewa/dataset.h"

namespace ewa::io {

struct PosedImage {
    std::string name;            // Frame::name
    std::filesystem::path path;  // of the picture, which may not exist
    Camera camera;               // OpenCV axes; width and height 0 where neither model nor picture tells
    std::filesystem::path mask;  // what the model names as its mask; empty: nothing
    Distortion distortion;
    int split = 0;  // Frame::split
};

/// Points left out because float32, which splats are stored in, cannot hold a coordinate as a finite number.
struct DroppedPoints {
    int count = 0;
    std::string first;  // where the first one stands
};

struct PosedImages {
    std::filesystem::path folder;    // images; smaller copies stand beside it, in images_2 and so on
    std::vector<PosedImage> images;  // in the file's order
    PointCloud points;
    DroppedPoints dropped;
    bool color_depends_on_view = true;  // Dataset::color_depends_on_view
};

/// Adds a point, or counts it as dropped. where: asked for the first dropped one.
void add_point(PointCloud& points, DroppedPoints& dropped, const glm::dvec3& position,
               const std::array<uint8_t, 3>& color, const std::function<std::string()>& where);

}  // namespace ewa::io
