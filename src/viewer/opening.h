// SPDX-License-Identifier: Apache-2.0
// What is to be seen: a splat file, a dataset, or the folder of a training run.
#pragma once
#include <filesystem>
#include <memory>
#include <string>

#include "ewa/dataset.h"
#include "viewer/render_thread.h"

namespace ewa::viewer {

struct Scene {
    std::string title;
    std::shared_ptr<const Gaussians> gaussians;  // never null; empty where a run has none yet
    std::shared_ptr<const Dataset> dataset;      // cameras; null: none
    std::filesystem::path run;                   // the run's folder; empty where it is none
    std::filesystem::file_time_type splats_time =
        std::filesystem::file_time_type::min();  // of the run's, when they were read
    Look look;                                   // how its file or its run says it is to be drawn
    std::string remark;                          // one line; what could not be had
};

/// A file with splats; a dataset, shown by its points; or a run's folder (config.json, splats.ply,
/// metrics.jsonl), with the cameras of its dataset where that is found. `cameras`: the dataset to use
/// instead, or empty. Throws InputError.
Scene open_scene(const std::filesystem::path& path, const std::filesystem::path& cameras);

/// Whether it is the folder of a training run, one that has just begun included.
bool is_run(const std::filesystem::path& path);

/// The points as small opaque splats.
Gaussians splats_of_points(const PointCloud& points);

}  // namespace ewa::viewer
