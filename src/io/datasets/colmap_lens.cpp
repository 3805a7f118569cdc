// SPDX-License-Identifier: Apache-2.0
#include "io/datasets/colmap_lens.h"

#include <algorithm>
#include <iterator>

#include "core/text.h"

namespace ewa::io {
namespace {

using D = Distortion;

/// Its two parameters are the width and height again.
constexpr std::string_view kEquirectangular = "EQUIRECTANGULAR";

// In the order of COLMAP's model ids. The terms are in the order of the file, after the principal point
// (COLMAP, src/colmap/sensor/models.h).
constexpr ColmapLens kLenses[] = {
    {"SIMPLE_PINHOLE", 1, Lens::brown, {}},
    {"PINHOLE", 2, Lens::brown, {}},
    {"SIMPLE_RADIAL", 1, Lens::brown, {&D::k1}},
    {"RADIAL", 1, Lens::brown, {&D::k1, &D::k2}},
    {"OPENCV", 2, Lens::brown, {&D::k1, &D::k2, &D::p1, &D::p2}},
    {"OPENCV_FISHEYE", 2, Lens::fisheye, {&D::k1, &D::k2, &D::k3, &D::k4}},
    {"FULL_OPENCV", 2, Lens::brown, {&D::k1, &D::k2, &D::p1, &D::p2, &D::k3, &D::k4, &D::k5, &D::k6}},
    {"FOV", 2, Lens::fov, {&D::k1}},
    {"SIMPLE_RADIAL_FISHEYE", 1, Lens::fisheye, {&D::k1}},
    {"RADIAL_FISHEYE", 1, Lens::fisheye, {&D::k1, &D::k2}},
    {"THIN_PRISM_FISHEYE",
     2,
     Lens::fisheye,
     {&D::k1, &D::k2, &D::p1, &D::p2, &D::k3, &D::k4, &D::s1, &D::s3}},
    {"RAD_TAN_THIN_PRISM_FISHEYE",
     2,
     Lens::fisheye624,
     {&D::k1, &D::k2, &D::k3, &D::k4, &D::k5, &D::k6, &D::p2, &D::p1, &D::s1, &D::s2, &D::s3, &D::s4}},
    {"SIMPLE_DIVISION", 1, Lens::division, {&D::k1}},
    {"DIVISION", 2, Lens::division, {&D::k1}},
    {"SIMPLE_FISHEYE", 1, Lens::fisheye, {}},
    {"FISHEYE", 2, Lens::fisheye, {}},
    {"EUCM", 2, Lens::unified, {&D::k1, &D::k2}},
    {kEquirectangular, 0, Lens::equirectangular, {}}};

}  // namespace

std::span<const ColmapLens> colmap_lenses() {
    return kLenses;
}

const ColmapLens* colmap_lens(int64_t id) {
    return id >= 0 && id < int64_t(std::size(kLenses)) ? &kLenses[id] : nullptr;
}

const ColmapLens* colmap_lens(std::string_view name) {
    const auto* found = std::find_if(std::begin(kLenses), std::end(kLenses),
                                     [&](auto& lens) { return core::lower(lens.name) == core::lower(name); });
    return found == std::end(kLenses) ? nullptr : found;
}

}  // namespace ewa::io
