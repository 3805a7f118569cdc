// SPDX-License-Identifier: Apache-2.0
// Opens what the window shows: a splat file, a dataset, or the folder of a training run.
#pragma once
#include <filesystem>
#include <memory>
#include <string>

#include "ewa/dataset.h"
#include "viewer/render_thread.h"

namespace ewa::viewer {

struct OpenedScene {
    std::string title;
    std::shared_ptr<const Gaussians> gaussians;  // never null; empty if a run has none yet
    std::shared_ptr<const Dataset> dataset;      // null: no cameras
    std::filesystem::path run;                   // folder of the run; empty: no run
    std::filesystem::file_time_type splats_time =
        std::filesystem::file_time_type::min();  // of the run's splats.ply
    Look look;                                   // as the file or the run asks for
    std::string remark;                          // one line: what is missing
};

/// Opens a splat file; a dataset, shown by its points; or the folder of a run (config.json, splats.ply,
/// metrics.jsonl) with the cameras of its dataset, if that is found. cameras: the dataset to use instead;
/// empty: none. Throws InputError.
OpenedScene open_scene(const std::filesystem::path& path, const std::filesystem::path& cameras);

/// Whether the folder is that of a training run, also of one that has just begun.
bool is_run(const std::filesystem::path& path);

/// Converts points to small opaque splats.
Gaussians splats_of_points(const PointCloud& points);

}  // namespace ewa::viewer
