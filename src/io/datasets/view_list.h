// SPDX-License-Identifier: Apache-2.0
// Named cameras in a JSON file. Sizes are in px; the rotation is world to camera, row after row:
//   {"views": [{"name": "...", "width": n, "height": n, "fx": n, "fy": n, "cx": n, "cy": n,
//               "rotation": [9 numbers], "translation": [3], "pivot": [3], "time": s}, ...]}
// The pivot may be missing, and there may be other keys. The times of a film are those of all views or none, each later than the one before. A view with "rolling_shutter", which has the words of transforms.json, also
// has "rotation_end" and "translation_end": the pose when the readout reaches the opposite border.
#pragma once
#include <filesystem>
#include <glm/vec3.hpp>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "ewa/camera.h"

namespace ewa::io {

struct NamedView {
    std::string name;
    Camera camera;
    glm::dvec3 pivot{0};              // world; the point that the viewer orbits
    bool aligned = false;             // see refined_cameras.h
    std::optional<double> time = {};  // s from the start of a film
};

inline constexpr size_t kMostViews = 10000;
inline constexpr size_t kMostCameras = 100000;  // of a dataset

/// Throws InputError that names the file and the view. Causes are more than `most` views, a value that is
/// missing or not finite, a size out of 1..65536, a rotation that is not orthonormal to 1e-6, or a time that is not after the last.
std::vector<NamedView> read_views(const std::filesystem::path& path, size_t most = kMostViews);

/// When a film passes the views (s): their times, or every `distance` seconds if the first has none.
std::vector<double> times_of(const std::vector<NamedView>& views, double distance);

/// A named camera as a JSON object in the form above, without the pivot.
nlohmann::ordered_json camera_json(const std::string& name, const Camera& camera);

/// Writes a temporary file and renames it. Every number survives a round trip unchanged. Throws RunError.
void write_views(const std::filesystem::path& path, const std::vector<NamedView>& views);

}  // namespace ewa::io
