// SPDX-License-Identifier: Apache-2.0
// The options of a whole training run, which ewa/run.h does.
#pragma once
#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include "ewa/camera.h"
#include "ewa/dataset.h"
#include "ewa/device.h"
#include "ewa/gaussians.h"
#include "ewa/ranks.h"
#include "ewa/train_options.h"

namespace ewa {

/// Whether further first splats are put between neighbouring points.
enum class DenseStart {
    automatic,  // on in short runs of Strategy::adc, else off
    on,
    off
};

/// Options of a run. `ewa train --help` describes the options of the same names.
struct RunOptions {
    std::filesystem::path dataset;  // folder or file, as load_dataset takes it
    std::filesystem::path scene;    // mesh scene, photos or video that the dataset was made from; empty: none
    std::filesystem::path output;   // the run's folder; empty: see output_folder
    TrainOptions train{.strategy = Strategy::automatic,
                       .sh_degree = kAutomaticShDegree,
                       .appearance = AppearanceModel::automatic,
                       .halvings = kAutomaticHalvings};
    /// First splats: "sfm" (the dataset's points), "stereo" (points on whose depth the images agree), "random", or a file of
    /// splats or points.
    std::string init = "sfm";
    /// A relative file of `init` is relative to this folder. Empty: the current folder.
    std::filesystem::path init_folder;
    DenseStart dense_start = DenseStart::automatic;  // of first splats that come from points
    double init_opacity = 0.1;   // of first splats that come from points or at random; above 0, below 1
    double init_scale = 1;       // factor of their scales: 1 is the distance to their neighbours
    std::string frames = "all";  // or a list, as scene::frames_named reads it: other frames are not used
    bool level = true;           // of photos whose cameras are searched: as CaptureOptions::level
    int downscale = 1;           // divides the images' width and height
    int max_width = 0;           // px; images that are wider after `downscale` are reduced to it; 0: none are
    MaskUse masks = MaskUse::automatic;
    LensUse lens = LensUse::automatic;
    /// With TrainOptions::refine_poses: the side at which the readout begins, for frames whose readout is not known. Training
    /// learns how their cameras move during it, and starts with no motion.
    std::optional<ReadoutFrom> rolling_shutter;
    /// Training images without transparency get a background of their mean colour, with TrainOptions::background_noise of 0.4
    /// (docs/training_options.md#background). Only if RenderOptions::background is black, and not with a sky, a random background,
    /// points, refined poses or `robust`.
    bool automatic_background = true;
    int test_every = 8;         // every K-th image in name order is held out; 0: none
    bool skip_blurred = false;  // skips training images that are blurred far more than the others
    bool robust = false;        // masks objects that single images show and the others do not
    int eval_every = 0;         // evaluates the held-out views every N steps; 0: only at the end
    std::string metrics;        // a list for metrics_named: evaluations measure these beside PSNR and SSIM
    bool tensorboard = false;   // also writes the figures of metrics.jsonl as TensorBoard's events
    int save_every = 0;  // saves splats and checkpoint every N steps; 0: the checkpoint every 30 s or more
    int keep = 0;        // the last N splats that save_every saved stay as splats_007000.ply and so on
    bool inria = false;  // also writes the folder inria/, for viewers of INRIA's runs
    // A folder with the result or the checkpoint of a run is refused, unless one of these is set.
    bool resume = false;  // continues from the folder's checkpoint, if there is one
    bool force = false;   // replaces the run in the folder
    DeviceOptions device;
    /// The processes that train together. Rank 0 writes the run's files and calls the observer. The others return an empty
    /// result when it ends.
    std::shared_ptr<Ranks> ranks = alone();
    int rank_timeout = 300;     // s; the run ends if one of several ranks does not answer for so long
    std::string command;        // how the run was started, for the report; may be empty
    double seconds_before = 0;  // wall time spent before the run, counted in Summary::wall_seconds
};

/// The run's name in the report: the stem of `scene`, else the name of the dataset's folder.
std::string run_name(const RunOptions& options);
/// RunOptions::output, or out/<run_name> if that is empty.
std::filesystem::path output_folder(const RunOptions& options);
/// Throws InputError if options exclude each other. run_training calls it first.
void check_options(const RunOptions& options);

}  // namespace ewa
