// SPDX-License-Identifier: Apache-2.0
// Synthetic datasets: renders of a glTF of triangles as a dataset for training.
#pragma once
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "ewa/appearance.h"
#include "ewa/camera.h"
#include "ewa/dataset.h"
#include "ewa/device.h"

namespace ewa {

/// A rolling shutter of all cameras. A camera's pose without it is that of the middle of its readout.
struct RollingShutter {
    ReadoutFrom from = ReadoutFrom::top;
    double degrees = 0;  // the turn of a camera during the readout, about an axis of its own; at most 90.
    /// How far a camera's centre moves during the readout, in a direction of its own: 0 to 100 % of its distance to the scene's
    /// middle.
    double percent = 0;
};

/// Options of render_dataset.
struct SyntheticOptions {
    /// The number of cameras on a dome over the scene. 0: the file's cameras. Empty: the file's cameras if it
    /// has 8 or more, else 48 on a dome.
    std::optional<int> views;
    int width = 256, height = 256;  // px, 1..16384
    int samples = 32;               // paths per pixel, 1..65536; powers of two are distributed best
    int points = 40000;             // on visible surfaces, for the initial splats; 0: none
    uint64_t seed = 0;
    /// Stops: a factor of 2^exposure between radiance and the image, where 1 is white. Empty: the highest exposure, in tenths of a
    /// stop, at which 95 of 100 surface pixels stay below 0.8.
    std::optional<double> exposure;
    /// ppisp: each image has an exposure and colours of its own, and all share a vignette and a response. Their means over
    /// all images change nothing. none: images are as develop makes them.
    AppearanceModel appearance = AppearanceModel::none;
    /// The lens of all cameras, which scene::is_native accepts. Parallel rays give a world unit at the scene's middle the size that
    /// the pinhole gives it.
    Distortion lens{};
    /// The angle that a fisheye's image spans along its smaller side: above 0, at most 360.
    double fisheye_degrees = 180;
    std::optional<RollingShutter> rolling_shutter;  // of all cameras, pinholes or fisheyes
    bool sky = false;    // images show the sky, and have no alpha; else they are transparent there
    bool force = false;  // replaces the views of another scene or of other options in the folder
};

/// The outcome of render_dataset.
struct SyntheticDataset {
    int views = 0;
    int kept = 0;                       // views that an earlier, interrupted run has rendered
    double exposure = 0;                // stops
    bool color_depends_on_view = true;  // false: every material is diffuse, and SH degree 0 suffices
    bool interrupted = false;
    uint64_t unfinished_rays = 0;      // ended by the limit on steps
    uint64_t dropped_samples = 0;      // paths that were not finite and count as black
    uint64_t dropped_triangles = 0;    // triangles of the file with a corner that is not finite
    std::vector<std::string> remarks;  // contents of the file that a render does not show
};

/// Whether the file is a glTF of triangles without splats. It throws nothing.
bool is_mesh_scene(const std::filesystem::path& path);

/// Renders the scene into a folder, in the glTF's own world frame. docs/meshes.md describes the light
/// transport.
/// - images/*.png: 8 bit, sRGB's curve over min(1, radiance * 2^exposure), with alpha where the sky is
///   visible, unless SyntheticOptions::sky shows it.
/// - depth/*.exr: camera z in world units, through another lens than a pinhole or a rolling shutter the distance; 0 for the sky.
/// - points.ply: initial points.
/// - appearance.json, with SyntheticOptions::appearance: what was applied to each image.
/// - `photographs.json` identifies scene and options. A matching folder is continued. Views of another scene or of
///   other options are replaced with SyntheticOptions::force, else refused.
/// - transforms.json: the cameras, written last.
///
/// progress(done, views) is called before the first view and after each; false ends the run. Throws InputError
/// for an unreadable scene, options out of range, or a folder with another dataset. Throws RunError
/// (disk, device).
SyntheticDataset render_dataset(const std::shared_ptr<gpu::Device>& device,
                                const std::filesystem::path& scene, const std::filesystem::path& folder,
                                const SyntheticOptions& options,
                                const std::function<bool(int, int)>& progress);

/// Whether the folder has every view that render_dataset would render with these options. Throws InputError
/// as that does, if the folder has a dataset of render_dataset.
bool is_rendered(const std::filesystem::path& scene, const std::filesystem::path& folder,
                 const SyntheticOptions& options);

/// The views that render_dataset would render, as a dataset without images and points. Frames have the same
/// names and an empty image_path. Throws InputError as that does.
Dataset scene_cameras(const std::filesystem::path& scene, const SyntheticOptions& options);

}  // namespace ewa
