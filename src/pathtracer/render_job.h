// SPDX-License-Identifier: Apache-2.0
// The work of rendering a dataset: scene, cameras and file names, and the record that identifies finished
// renders.
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

/// The record in a folder of renders. Folders of earlier versions have this name, so it stays.
inline constexpr const char* kRecord = "photographs.json";

/// The decoded images of the scene's textures: PNG and JPEG, as in glTF, of at most 8192 x 8192 pixels.
/// Throws InputError that names the image.
std::vector<Image> decode_images(const scene::MeshScene& scene);

struct RenderJob {
    SyntheticOptions options;
    std::string name;  // of the scene's file
    scene::MeshScene scene;
    pathtracer::PackedScene packed;
    std::vector<Camera> cameras;

    /// A hash of everything that the images depend on.
    std::string fingerprint() const;
    /// Paths relative to the dataset's folder.
    std::string image_name(size_t view) const;
    std::string depth_name(size_t view) const;
    /// Whether image and depth of a view exist. The depth is written last.
    bool rendered(const std::filesystem::path& folder, size_t view) const;
};

/// Reads and packs the scene. Throws InputError as io::read_gltf_mesh does, for options out of range, and if
/// the options ask for the file's cameras but it has none.
RenderJob read_render_job(const std::filesystem::path& scene, const SyntheticOptions& options);

/// The contents of a folder's record. Empty if the record is missing or unreadable.
struct Record {
    std::string fingerprint;
    std::optional<double> exposure;  // stops
};
std::optional<Record> read_record(const std::filesystem::path& folder);

}  // namespace ewa::pathtracer
