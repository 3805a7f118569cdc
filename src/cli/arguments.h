// SPDX-License-Identifier: Apache-2.0
// Arguments that several commands share, and the datasets that they name.
#pragma once
#include <CLI/CLI.hpp>

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/folders.h"
#include "core/pixel_size.h"
#include "ewa/dataset.h"
#include "ewa/device.h"
#include "ewa/gaussians.h"
#include "ewa/render_options.h"
#include "ewa/run_options.h"
#include "ewa/synthetic_dataset.h"
#include "io/datasets/refined_cameras.h"
#include "options/command_options.h"

namespace ewa::cli {

/// The size that --size names, such as 1280x720. Throws InputError.
core::PixelSize size_of(const std::string& text);

/// How a scene is rendered: --background, --kernel, --points, --nearest, --sh-degree, --integrator, --samples.
struct DrawArguments {
    std::string background = "0,0,0";
    std::string kernel = "peak";
    int sh_degree = kMaxShDegree;
    bool points = false;
    std::optional<int> nearest;
    const CLI::Option *kernel_option = nullptr, *background_option = nullptr;
    std::string integrator = "splat";
    std::optional<int> samples;

    /// Throws InputError if the background is not a colour, or the options exclude each other.
    RenderOptions options() const;
    bool names_background() const { return background_option && background_option->count() > 0; }
    bool names_kernel() const { return kernel_option && kernel_option->count() > 0; }
    /// Reads splats to draw, with warnings about skipped ones. Without --kernel, options.kernel is the kernel that the file
    /// names, as a density or as antialiased. Without --background, options.sky is the sky.json beside the file, if it
    /// exists. Converts densities to the kernel.
    Gaussians load(const std::filesystem::path& splats, RenderOptions& options) const;
};
void add_draw_options(CLI::App& app, DrawArguments& arguments);

/// --device and --validation.
void add_device_options(CLI::App& app, DeviceOptions& options);

/// The indices of the frames that --frames names: "all", "train", "test", or a list that scene::frames_named
/// reads. Throws InputError, also if there are none.
std::vector<int> select_frames(const Dataset& dataset, const std::string& which, int test_every);

// DATASET names an input of load_dataset(), or a glTF file of meshes, which has no images and is rendered.

/// The cameras of a dataset, whose images may all be missing. If only some are missing, their frames are skipped, so that
/// the same frames are held out as in training. Dataset::missing_images counts them. A mesh scene has the views that
/// `ewa train` renders. options: only downscale, max_width and lens are used. points: also reads the points.
Dataset load_cameras_as_trained(const std::filesystem::path& path, const RunOptions& options = {},
                                bool points = false);

/// Renders a mesh scene into a dataset, with progress, and prints its notes. Throws InputError, RunError, and
/// Interrupted if Ctrl-C ended it.
void render_with_progress(const DeviceOptions& device, const std::filesystem::path& scene,
                          const std::filesystem::path& folder, const SyntheticOptions& options, bool quiet);

/// A splat scene and a dataset whose images it is compared with.
struct ViewArguments {
    std::filesystem::path splats, dataset;
    std::filesystem::path refined_cameras = {};  // cameras.json of that run; empty: none
    std::string run_frames = "all";              // --frames of the run SPLATS, if the dataset is its own
    RunOptions run = {};                         // --downscale, --max-width, --masks and --lens
    DrawArguments draw;
    DeviceOptions device;
};
/// Adds the arguments SPLATS and DATASET. resolve_views() of run_inputs.h replaces runs among them after parsing.
void add_view_positionals(CLI::App& app, ViewArguments& arguments);
/// Adds the options of the other members of ViewArguments.
void add_view_options(CLI::App& app, ViewArguments& arguments);

struct Views {
    Dataset dataset;
    io::RefinedUse refined;                         // of the cameras of a run
    std::vector<int> frames;                        // indices of the selected frames
    std::unique_ptr<core::TemporaryFolder> folder;  // of the images, or null
};
/// Loads a dataset with its images. For a mesh scene, loads the folder `dataset` that `ewa train` wrote beside the splats,
/// if its images show this scene. Else renders the mesh into a temporary folder. which, test_every: as in select_frames().
/// Throws InputError before rendering, and Interrupted if Ctrl-C ended the rendering.
Views load_views(const ViewArguments& arguments, const std::string& which, int test_every);

}  // namespace ewa::cli
