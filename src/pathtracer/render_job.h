// SPDX-License-Identifier: Apache-2.0
// What is photographed: the scene, from which cameras, and the files that its photographs become.
#pragma once
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "ewa/camera.h"
#include "ewa/synthetic_dataset.h"
#include "pathtracer/packing.h"
#include "scene/mesh_scene.h"

namespace ewa::pathtracer {

/// The file in a folder of photographs that names what they are of.
inline constexpr const char* kRecord = "photographs.json";

struct RenderJob {
    SyntheticOptions options;
    std::string name;  // of the scene's file
    scene::MeshScene scene;
    pathtracer::PackedScene packed;
    std::vector<Camera> cameras;

    /// Of everything that the pictures depend on.
    std::string fingerprint() const;
    /// Paths within the folder of photographs.
    std::string image_name(size_t view) const;
    std::string depth_name(size_t view) const;
    /// The depth is written last.
    bool taken(const std::filesystem::path& folder, size_t view) const;
};

/// Throws InputError: the file, as io/gltf_mesh.h says; options out of range; no cameras where the file's are
/// asked for.
RenderJob read_render_job(const std::filesystem::path& scene, const SyntheticOptions& options);

/// What a folder's record says of the photographs in it; nothing where there is none that can be read.
struct Record {
    std::string fingerprint;
    std::optional<double> exposure;  // stops
};
std::optional<Record> read_record(const std::filesystem::path& folder);

}  // namespace ewa::pathtracer
