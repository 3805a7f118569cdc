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

inline constexpr size_t kUsualBudget = 1'000'000;  // splats

struct OpenedScene {
    std::string title;           // empty: nothing is open
    std::filesystem::path path;  // as it was named
    /// Photos or a video. Without a dataset: their cameras are not known yet. With one: they were found.
    std::filesystem::path photos;
    bool points = false;  // the splats are the points of the dataset
    /// Never null; empty if a run has none yet. set_gaussians() also sets the next two.
    std::shared_ptr<const Gaussians> gaussians = std::make_shared<const Gaussians>();
    /// A level within the budget, for a view that changes, where a lod-meta.json has more splats. Null: none.
    std::shared_ptr<const Gaussians> coarse;
    int sh_degree = 0;                       // the highest that changes the image
    std::vector<PlanLine> plan;              // what rendering skips
    std::shared_ptr<const Dataset> dataset;  // null: no cameras
    std::vector<CameraSupport> supports;     // of the dataset's frames; empty: not known
    std::filesystem::path run;               // folder of the run; empty: no run
    std::filesystem::path cameras;           // the path of the dataset, if not `path`
    /// The time of the run's splats.ply.
    std::filesystem::file_time_type splats_time = std::filesystem::file_time_type::min();
    /// The learned appearances of the dataset's frames, by name.
    std::map<std::string, Appearance> appearances;
    NewViewAppearance of_new_views;
    Look look;           // as the file or the run asks for
    std::string remark;  // one line: what is missing

    void set_gaussians(std::shared_ptr<const Gaussians> splats);
};

/// What the window calls a scene of this path.
std::string scene_title(const std::filesystem::path& path);

/// Whether open_scene() would open the path as a dataset, and not as splats or a run. False if it does not exist.
bool is_dataset(const std::filesystem::path& path);

/// Opens a splat file; a dataset, shown by its points; or the folder of a run (config.json, splats.ply,
/// metrics.jsonl). A run, and the splats.ply of a run, come with the cameras of the run's dataset, if that is
/// found. cameras: the dataset to use instead; empty: none. Photos without cameras, or a video, only set `photos` and
/// the title. Throws InputError.
/// budget: splats of OpenedScene::coarse, at most unless all levels have more. A damaged level is no error, but a remark.
OpenedScene open_scene(const std::filesystem::path& path, const std::filesystem::path& cameras,
                       size_t budget = kUsualBudget);

/// The splats of `splats` with the cameras of `cameras`, and a remark that says so. Both are scenes as opened.
OpenedScene with_cameras(const OpenedScene& splats, const OpenedScene& cameras);

/// Opens what was dropped on the window, where `shown` is. budget: as of open_scene(). Throws InputError.
/// - Photos or a video go before all else: only they are opened.
/// - A dataset gives its cameras to the splats that are shown, unless it has done so before: then it is opened itself.
/// - A splat file takes the cameras of a dataset that is shown without splats.
/// - Among several files, splats and a dataset belong together. The remark names the skipped ones.
OpenedScene open_dropped(const std::vector<std::filesystem::path>& paths, const OpenedScene& shown,
                         size_t budget = kUsualBudget);

/// Converts points to small opaque splats.
Gaussians splats_of_points(const PointCloud& points);

}  // namespace ewa::viewer
