// SPDX-License-Identifier: Apache-2.0
// A whole training run: from a dataset on disk to splats, checkpoint and report. `ewa train` is built on it.
#pragma once
#include <filesystem>

#include "ewa/run_observer.h"
#include "ewa/run_options.h"
#include "ewa/summary.h"

namespace ewa {

/// The outcome of a run.
struct RunResult {
    Summary summary;                     // Summary::interrupted: should_stop ended the run
    std::filesystem::path folder;        // output_folder
    std::filesystem::path first_render;  // the first of the report's images; empty if there is none
};

/// Trains, evaluates, and writes into the run's folder:
/// - config.json: the options, as `ewa train --config` takes them.
/// - metrics.jsonl: a MetricsLine every 1 % of the steps and at each evaluation.
/// - events.out.tfevents.0.ewa, with RunOptions::tensorboard: the same figures for TensorBoard.
/// - checkpoint.ewa, times.json: the state to resume from, and the times up to it.
/// - splats.ply: the splats.
/// - cameras.json and the COLMAP model cameras/sparse/0, with TrainOptions::refine_poses: the refined cameras.
/// - passers_by/*.png, with `robust`: masks of objects that single training images show.
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
/// The same without an observer.
RunResult run_training(const RunOptions& options);

}  // namespace ewa
