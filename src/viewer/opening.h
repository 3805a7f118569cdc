// SPDX-License-Identifier: Apache-2.0
// Opens what the window shows: a splat file, a dataset, or the folder of a training run.
#pragma once
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "ewa/appearance.h"
#include "ewa/dataset.h"
#include "viewer/render_thread.h"

namespace ewa::viewer {

inline constexpr size_t kUsualBudget = 1'000'000,
                        kCpuBudget = 200'000;  // splats to draw while the view changes

struct OpenedScene {
    std::string title;           // empty: nothing is open
    std::filesystem::path path;  // as the user named it
    /// Photos or a video. Their cameras are unknown while `dataset` is null; else `dataset` has them.
    std::filesystem::path photos;
    bool points = false;  // the splats are the points of the dataset
    /// The splats: never null, but empty while a run has written none. set_gaussians() also sets `sh_degree` and `plan`.
    std::shared_ptr<const Gaussians> gaussians = std::make_shared<const Gaussians>();
    /// A coarser level within the budget, drawn while the view changes. Null unless a lod-meta.json has more splats than that.
    std::shared_ptr<const Gaussians> coarse;
    int sh_degree = 0;                       // the highest SH degree with coefficients that change the image
    std::vector<PlanLine> plan;              // one entry for each kind of splats that rendering skips
    std::shared_ptr<const Dataset> dataset;  // null: no cameras
    std::vector<CameraSupport> supports;     // of the dataset's frames; empty: not known
    std::filesystem::path run;               // folder of the run; empty: no run
    std::filesystem::path cameras;           // the path of the dataset, if not `path`
    /// The time of the run's splats.ply.
    std::filesystem::file_time_type splats_time = std::filesystem::file_time_type::min();
    /// The learned appearances of the dataset's frames, by name.
    std::map<std::string, Appearance> appearances;
    NewViewAppearance of_new_views;
    Look look;           // initial look, which the file or the run gives
    std::string remark;  // one line: what is missing

    void set_gaussians(std::shared_ptr<const Gaussians> splats);
};

/// The title that the window shows for a scene opened from this path.
std::string scene_title(const std::filesystem::path& path);

/// Whether open_scene() would open the path as a dataset, and not as splats or a run. False if it does not exist.
bool is_dataset(const std::filesystem::path& path);

/// Opens a splat file; a dataset, shown by its points; or the folder of a run (config.json, splats.ply,
/// metrics.jsonl). A run, and the splats.ply of a run, come with the cameras of the run's dataset, if that is
/// found. cameras: the dataset to use instead of the run's; empty: none. Photos without cameras, or a video, only set `photos`
/// and the title. Throws InputError.
/// budget: most splats of OpenedScene::coarse, unless all levels have more. A damaged level gives a remark, not an error.
OpenedScene open_scene(const std::filesystem::path& path, const std::filesystem::path& cameras,
                       size_t budget = kUsualBudget);

/// The splats of `splats` with the cameras of `cameras`, and a remark that says so. Both are scenes as opened.
OpenedScene with_cameras(const OpenedScene& splats, const OpenedScene& cameras);

/// Opens files that were dropped on a window that shows `shown`. budget: as of open_scene(). Throws InputError.
/// - If photos or a video are among the paths, only they are opened.
/// - A dataset gives its cameras to the shown splats. If they have its cameras already, the dataset itself is opened.
/// - A splat file takes the cameras of a dataset that is shown without splats.
/// - Among several files, splats and a dataset belong together. The remark names the skipped ones.
OpenedScene open_dropped(const std::vector<std::filesystem::path>& paths, const OpenedScene& shown,
                         size_t budget = kUsualBudget);

/// Converts points to small opaque splats.
Gaussians splats_of_points(const PointCloud& points);

}  // namespace ewa::viewer
