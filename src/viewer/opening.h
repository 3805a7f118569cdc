// SPDX-License-Identifier: Apache-2.0
// Opens what the window shows: a splat file, a dataset, or the folder of a training run.
#pragma once
#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include "ewa/dataset.h"
#include "viewer/render_thread.h"

namespace ewa::viewer {

struct OpenedScene {
    std::string title;
    /// Never null; empty if a run has none yet. set_gaussians() also sets the next two.
    std::shared_ptr<const Gaussians> gaussians = std::make_shared<const Gaussians>();
    int sh_degree = 0;                       // the highest that changes the image
    std::vector<PlanLine> plan;              // what rendering skips
    std::shared_ptr<const Dataset> dataset;  // null: no cameras
    std::filesystem::path run;               // folder of the run; empty: no run
    /// Of the run's splats.ply.
    std::filesystem::file_time_type splats_time = std::filesystem::file_time_type::min();
    Look look;           // as the file or the run asks for
    std::string remark;  // one line: what is missing

    void set_gaussians(std::shared_ptr<const Gaussians> splats);
};

/// Opens a splat file; a dataset, shown by its points; or the folder of a run (config.json, splats.ply,
/// metrics.jsonl). A run, and the splats.ply of a run, come with the cameras of the run's dataset, if that is
/// found. cameras: the dataset to use instead; empty: none. Throws InputError.
OpenedScene open_scene(const std::filesystem::path& path, const std::filesystem::path& cameras);

/// Converts points to small opaque splats.
Gaussians splats_of_points(const PointCloud& points);

}  // namespace ewa::viewer
