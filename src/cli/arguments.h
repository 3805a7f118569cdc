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
    /// Reads splats to draw, with warnings of what is skipped. Without a kernel that is named, sets options.kernel to
    /// that of the file: of its density, or its mark of antialiasing. Without a background that is named, a sky.json beside the
    /// file is options.sky. Fits densities to the kernel.
    Gaussians load(const std::filesystem::path& splats, RenderOptions& options) const;
};
void add_draw_options(CLI::App& app, DrawArguments& arguments);

/// --device and --validation.
void add_device_options(CLI::App& app, DeviceOptions& options);

/// The indices of the frames that --frames names: "all", "train", "test", or a list that scene::frames_named
/// reads. Throws InputError, also if there are none.
std::vector<int> select_frames(const Dataset& dataset, const std::string& which, int test_every);

// A DATASET is what load_dataset reads, or a glTF file of meshes.

/// The cameras of a dataset, whose images may be missing. If only some are, their frames are skipped as in
/// training, so that the same frames are held out; Dataset::missing_images counts them. A mesh scene has the
/// views that `ewa train` renders. options: downscale, max_width and lens count. points: also reads the points.
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
/// SPLATS and DATASET, which resolve_views of run_inputs.h then completes.
void add_view_positionals(CLI::App& app, ViewArguments& arguments);
/// The options of the other members.
void add_view_options(CLI::App& app, ViewArguments& arguments);

struct Views {
    Dataset dataset;
    io::RefinedUse refined;                         // of the cameras of a run
    std::vector<int> frames;                        // those that were asked for
    std::unique_ptr<core::TemporaryFolder> folder;  // of the images, or null
};
/// Loads a dataset with its images. A mesh scene has the images that `ewa train` stored in `dataset` beside the
/// splats, if they show this scene. Else it is rendered into a temporary folder. which, test_every: as in
/// select_frames, whose error comes before the rendering. Throws Interrupted if Ctrl-C ended the rendering.
Views load_views(const ViewArguments& arguments, const std::string& which, int test_every);

}  // namespace ewa::cli
