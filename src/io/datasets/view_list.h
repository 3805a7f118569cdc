// SPDX-License-Identifier: Apache-2.0
// Named cameras in a JSON file: {"views": [{"name": "...", "width": px, "height": px, "fx": px, "fy": px,
// "cx": px, "cy": px, "rotation": [9 numbers, world to camera, row after row], "translation": [3], "pivot":
// [3]}, ...]}.
#pragma once
#include <filesystem>
#include <glm/vec3.hpp>
#include <string>
#include <vector>

#include "ewa/camera.h"

namespace ewa::io {

struct NamedView {
    std::string name;
    Camera camera;
    glm::dvec3 pivot{0};  // world; what it looks at
};

inline constexpr size_t kMostViews = 10000;

/// Throws InputError that names the file and the view: more than kMostViews, a value that is missing or not
/// finite, a size out of 1..65536, a rotation that is none (to 1e-6).
std::vector<NamedView> read_views(const std::filesystem::path& path);

/// Written beside and renamed; every number is read back as it was. Throws RunError.
void write_views(const std::filesystem::path& path, const std::vector<NamedView>& views);

}  // namespace ewa::io
