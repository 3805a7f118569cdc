// SPDX-License-Identifier: Apache-2.0
// Renders of mesh scenes: from a glTF of triangles to a dataset to train on.
#pragma once
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "ewa/dataset.h"
#include "ewa/device.h"

namespace ewa {

struct SyntheticOptions {
    /// Cameras on a dome over the scene; 0: those of the file; nothing said: those of the file where it has 8
    /// or more, else a dome of 48.
    std::optional<int> views;
    int width = 256, height = 256;  // px, 1..16384
    int samples = 32;               // paths a pixel, 1..65536; powers of two are spread best
    int points = 40000;             // on visible surfaces, for the first splats; 0: none
    uint64_t seed = 0;
    /// Stops (a factor of 2^exposure) between radiance and the picture, where 1 is white. Nothing said: such
    /// that 95 of 100 surface pixels stay under 0.8, in tenths of a stop.
    std::optional<double> exposure;
};

struct SyntheticDataset {
    int views = 0;
    int kept = 0;         // of them: were in the folder already, from an earlier run that was ended
    double exposure = 0;  // stops
    bool color_depends_on_view = true;  // false: every material is diffuse, and SH degree 0 suffices
    bool interrupted = false;
    uint64_t unfinished_rays = 0;      // ended by the limit on steps: they see nothing behind it
    uint64_t dropped_samples = 0;      // paths that were not finite and count as black
    uint64_t dropped_triangles = 0;    // of the file, with a corner that is not finite
    std::vector<std::string> remarks;  // what the file has and a photograph does not show
};

/// Whether the file is a glTF of triangles without splats.
bool is_mesh_scene(const std::filesystem::path& path);

/// Renders the scene into a folder: images/*.png (8 bit, sRGB's curve over min(1, radiance * 2^exposure),
/// alpha where the sky is seen), depth/*.exr (camera z in world units, 0 where nothing is), points.ply, and
/// last transforms.json, in the glTF's own world. docs/meshes.md says what light is modelled.
/// photographs.json names what the pictures are of: an ended run goes on where it was, and a folder of other
/// photographs is made anew. progress(done, views) is asked before the first view and after each; false ends
/// the run. Throws InputError (the file, as io/gltf_mesh.h says; a folder with a dataset that is not of this
/// kind; options out of range), RunError (disk, device).
SyntheticDataset render_dataset(const std::shared_ptr<gpu::Device>& device,
                                const std::filesystem::path& scene, const std::filesystem::path& folder,
                                const SyntheticOptions& options,
                                const std::function<bool(int, int)>& progress);

/// Whether the folder holds every photograph that render_dataset would take, with the same options. Throws
/// InputError as that does.
bool is_rendered(const std::filesystem::path& scene, const std::filesystem::path& folder,
                 const SyntheticOptions& options);

/// The views that render_dataset would take, as a dataset without pictures or points: frames are named as
/// there, and have no image_path. Throws InputError as that does.
Dataset scene_cameras(const std::filesystem::path& scene, const SyntheticOptions& options);

}  // namespace ewa
