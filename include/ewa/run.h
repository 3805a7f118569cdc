// SPDX-License-Identifier: Apache-2.0
// A whole training run: from a dataset on disk to splats, checkpoint and report. `ewa train` is built on it.
#pragma once
#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "ewa/dataset.h"
#include "ewa/device.h"
#include "ewa/evaluation.h"
#include "ewa/summary.h"
#include "ewa/trainer.h"

namespace ewa {

/// The result of a training, for RunOptions::report_section.
struct RunScene {
    std::shared_ptr<gpu::Device> device;
    const Gaussians& gaussians;
    const Camera& camera;  // of the first test view, or of the first training view without a test set
    const RenderOptions& options;
};

/// Whether splats start between neighbouring points, too.
enum class DenseStart {
    automatic,  // in short runs of adc
    on,
    off
};

/// What a run is asked for. `ewa train --help` describes the options of the same names.
struct RunOptions {
    std::filesystem::path dataset;  // folder or file, as load_dataset takes it
    std::filesystem::path scene;    // mesh scene, photos or video that the dataset was made from; empty: none
    std::filesystem::path output;   // the run's folder; empty: see output_folder
    TrainOptions train{.strategy = Strategy::automatic, .sh_degree = kAutomaticShDegree};
    std::string init =
        "sfm";  // first splats: "sfm" (the dataset's points), "random", or a file of splats or points
    std::filesystem::path
        init_folder;  // that a relative file of `init` is relative to; empty: the current one
    DenseStart dense_start = DenseStart::automatic;  // of first splats that come from points
    double init_opacity = 0.1;   // of first splats that come from points or at random; above 0, below 1
    double init_scale = 1;       // factor of their scales, which are the distance to their neighbours
    std::string frames = "all";  // or a list, as scene::frames_named reads it: other frames are not used
    int downscale = 1;           // divides the images' width and height
    int max_width = 0;           // px; images that are wider after `downscale` are reduced to it; 0: none are
    MaskUse masks = MaskUse::automatic;
    int test_every = 8;                   // every K-th image in name order is held out; 0: none
    int eval_every = 0;                   // evaluates the held-out views every N steps; 0: only at the end
    std::string metrics;                  // that evaluations measure beside PSNR and SSIM: see metrics_named
    std::filesystem::path lpips_weights;  // see Meter; empty: LPIPS is not computed
    bool tensorboard = false;             // also writes the figures of metrics.jsonl as TensorBoard's events
    int save_every = 0;  // saves splats and checkpoint every N steps; 0: the checkpoint every 30 s or more
    int keep = 0;        // of the splats of save_every, the last N stay as splats_007000.ply and the like
    bool inria = false;  // also writes the folder inria/, for viewers of INRIA's runs
    // A folder with the result or the checkpoint of a run is refused, unless one of these is set.
    bool resume = false;  // continues from the folder's checkpoint, if there is one
    bool force = false;   // replaces the run in the folder
    DeviceOptions device;
    /// The processes that train together. Rank 0 writes the run's files and calls the observer. The others return an empty
    /// result when it ends.
    std::shared_ptr<Ranks> ranks = alone();
    int rank_timeout = 300;     // s; of several ranks, one that does not answer for so long ends the run
    std::string command;        // how the run was started, for the report; may be empty
    double seconds_before = 0;  // wall time spent before the run, counted in Summary::wall_seconds
    /// Returns HTML that the report contains as it is. Called at the end of a run that was not stopped.
    std::function<std::string(const RunScene&)> report_section;
};

/// The run's name in the report: the stem of `scene`, else the name of the dataset's folder.
std::string run_name(const RunOptions& options);
/// RunOptions::output, or out/<run_name> if that is empty.
std::filesystem::path output_folder(const RunOptions& options);
/// Throws InputError if options exclude each other. run_training calls it first.
void check_options(const RunOptions& options);

/// What is known of a run before its training begins.
struct RunStart {
    std::string name;  // run_name
    size_t train_views = 0, test_views = 0;
    int width = 0, height = 0;         // of the first training image, px
    size_t splats = 0;                 // to start from
    TrainOptions train;                // with concrete values, but for max_splats
    uint32_t max_splats = 0;           // of the run
    size_t evaluated = 0;              // views that are rendered at the end
    std::vector<std::string> remarks;  // one line each, e.g. "3 images are missing and are skipped"
    DeviceInfo device;
    MemoryEstimate memory;
};

/// Follows a run and may end it. All calls come from the thread that called run_training, in the order of
/// their declarations. An exception from any of them ends the run and reaches the caller of run_training.
class RunObserver {
  public:
    virtual ~RunObserver() = default;

    /// Asked before each step and each evaluated view. True ends the run: splats and checkpoint are saved, and
    /// a run with RunOptions::resume can continue it.
    virtual bool should_stop() { return false; }
    /// One line for the user.
    virtual void on_note(const std::string&) {}

    /// The dataset and the device are open. No device memory is allocated yet.
    virtual void on_start(const RunStart&) {}
    /// What the training skips because the scene does not need it.
    virtual void on_plan(const std::vector<PlanLine>&) {}
    /// Training begins. metrics: the lines of the run that this one continues.
    virtual void on_begin(const std::filesystem::path& /*folder*/,
                          const std::vector<MetricsLine>& /*metrics*/) {}
    /// A step is done.
    virtual void on_step(const StepReport&) {}
    /// The held-out views were evaluated after this step, which is not the last one.
    virtual void on_evaluation(int /*step*/, const Evaluation&) {}
    /// A line was added to metrics.jsonl.
    virtual void on_metrics(const MetricsLine&) {}
    /// All work after a step is done, and another step follows. save: writes splats.ply and checkpoint.ewa.
    virtual void between_steps(const StepReport&, const Trainer&, const std::function<void()>& /*save*/) {}
    /// Training has ended. splats.ply and checkpoint.ewa are written.
    virtual void on_saved(const StepReport&) {}
    /// The final evaluation has evaluated `done` of `views` views.
    virtual void on_view(size_t /*done*/, size_t /*views*/) {}
    /// The final evaluation is done, unless the run was stopped. No more metrics follow.
    virtual void on_evaluated(const StepReport&, const Gaussians&) {}
};

struct RunResult {
    Summary summary;                     // Summary::interrupted: should_stop ended the run
    std::filesystem::path folder;        // output_folder
    std::filesystem::path first_render;  // of the report's images; empty if there is none
};

/// Trains, evaluates, and writes into the run's folder:
/// - config.json: the options, as `ewa train --config` takes them.
/// - metrics.jsonl: a MetricsLine every 1 % of the steps and at each evaluation.
/// - events.out.tfevents.0.ewa, with RunOptions::tensorboard: the same figures for TensorBoard.
/// - checkpoint.ewa, times.json: the state to resume from, and the times up to it.
/// - splats.ply: the splats.
/// - cameras.json and the COLMAP model cameras/sparse/0, with TrainOptions::refine_poses: the refined cameras.
/// - exposures.json, with TrainOptions::exposure: three rows of four numbers for each training image.
/// - splats_007000.ply and so on, with `keep`: the splats after these steps.
/// - inria/, with `inria`: cfg_args, cameras.json, input.ply, point_cloud/iteration_N/point_cloud.ply.
/// - test/*.png: renders of some test views (train/*.png without a test set).
/// - summary.json: the Summary.
/// - report.html: the figures, curves and views in one page. It needs no other file and no network.
///
/// One run at a time may use a folder. Each file but metrics.jsonl is replaced as a whole.
/// If an image vanishes during training, the checkpoint is saved before the error is thrown.
/// With RunOptions::resume the options must be those of the checkpoint, but `steps` may differ: the rest of the run then
/// has the schedule of the new number. Strategy::automatic keeps the checkpoint's strategy.
/// Throws InputError: options, dataset, start splats, a checkpoint of other options or of a later step, a folder with an
/// earlier run, an output that is an input. Throws RunError: device, memory, disk, a folder that another run uses.
RunResult run_training(const RunOptions& options, RunObserver& observer);
RunResult run_training(const RunOptions& options);

}  // namespace ewa
