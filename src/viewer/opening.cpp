// SPDX-License-Identifier: Apache-2.0
#include "viewer/opening.h"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "capture/run_inputs.h"
#include "capture/what_is.h"
#include "core/folders.h"
#include "core/typing.h"
#include "core/words.h"
#include "ewa/capture.h"
#include "ewa/error.h"
#include "ewa/sky_map.h"
#include "ewa/splat_files.h"
#include "ewa/synthetic_dataset.h"
#include "folders/run_folder.h"
#include "io/datasets/refined_cameras.h"
#include "platform/file_facts.h"
#include "scene/looks.h"

namespace ewa::viewer {
namespace {

namespace fs = std::filesystem;

constexpr float kPointOpacity = 3;    // logit
constexpr float kPointShrink = 1.2f;  // subtracted from the logarithm of a point's size

/// points: also load the points, which are read only together with the images.
/// refined: cameras.json of the run; empty: none.
std::shared_ptr<const Dataset> load_cameras(const fs::path& path, DatasetOptions options, bool points,
                                            const fs::path& refined = {}) {
    Dataset dataset;
    if (what_is(path) == What::mesh) dataset = scene_cameras(path, {});
    try {
        if (points && dataset.frames.empty()) dataset = load_dataset(path, options);
    } catch (const InputError&) {
        // An image or the points are invalid: the cameras alone may still load.
    }
    options.need_images = options.need_points = false;
    if (dataset.frames.empty()) dataset = load_dataset(path, options);
    // Skip frames without an image, unless all are, as training and `ewa render` do.
    const auto missing = [](const Frame& frame) { return !frame.image_exists; };
    if (!std::all_of(dataset.frames.begin(), dataset.frames.end(), missing))
        std::erase_if(dataset.frames, missing);
    if (dataset.frames.empty()) throw InputError(path.string() + " has no frames");
    if (!refined.empty()) io::use_refined_cameras(dataset, refined);
    return std::make_shared<const Dataset>(std::move(dataset));
}

Look look_of(const folders::Run& run) {
    Look look;
    const fs::path sky = run.folder / folders::kSkyFile;
    try {
        if (run.text("background") == "sky" && core::is_file(sky))
            look.sky = std::make_shared<const SkyMap>(load_sky(sky));
    } catch (const InputError&) {
        // The splats are shown over black.
    }
    look.kernel = core::find_value(scene::kKernelWords, run.text("kernel")).value_or(look.kernel);
    look.points = run.flag("points");
    look.nearest = run.number("nearest", 1, kMostNearest, look.nearest);
    look.background = core::parse_colour(run.text("background")).value_or(look.background);
    return look;
}

void add_appearances(OpenedScene& scene, const folders::Run& run) {
    for (const char* name : {folders::kAppearanceFile, folders::kOldExposuresFile}) {
        if (!core::is_file(run.folder / name)) continue;
        try {
            scene.appearances = load_appearances(run.folder / name);
        } catch (const InputError&) {
            return;  // only the PSNR of images depends on them
        }
        std::vector<Appearance> all;
        std::vector<glm::dvec3> centers;
        for (const Frame& frame : scene.dataset->frames)
            if (const auto own = scene.appearances.find(frame.name); own != scene.appearances.end()) {
                all.push_back(own->second);
                centers.push_back(frame.camera.position());
            }
        scene.of_new_views = NewViewAppearance(std::move(all), std::move(centers));
        return;
    }
}

/// cameras: the dataset to use instead of the run's; empty: none.
void add_cameras(OpenedScene& scene, const folders::Run& run, const fs::path& cameras, bool points) {
    const fs::path dataset = cameras.empty() ? run.dataset : cameras;
    try {
        if (!dataset.empty())
            scene.dataset = load_cameras(dataset, capture::dataset_options_of(run), points,
                                         cameras.empty() ? run.refined_cameras() : fs::path());
        else
            scene.remark = "the dataset of this run was not found; name it with --cameras DATASET";
        if (cameras.empty() && scene.dataset) add_appearances(scene, run);
    } catch (const InputError& problem) {
        if (!cameras.empty()) throw;
        scene.remark = problem.what();
    }
}

OpenedScene open_run(const folders::Run& run, const fs::path& cameras) {
    OpenedScene scene;
    scene.run = run.folder;
    scene.look = look_of(run);
    const bool splats = !run.splats.empty();
    if (splats) {
        std::error_code error;
        scene.splats_time = platform::write_time(run.splats, error);
        scene.gaussians = std::make_shared<const Gaussians>(load_splats(run.splats));
    }
    add_cameras(scene, run, cameras, !splats);
    if (!splats && scene.dataset) {
        scene.gaussians = std::make_shared<const Gaussians>(splats_of_points(scene.dataset->points));
        scene.points = true;
    }
    return scene;
}

/// The finest level of a lod-meta.json that has splats, at most `budget` of them, and is not damaged; or else the last one. Null where
/// level 0, of `splats` splats, is such a level, and where there is no other. Adds damage to the remark.
std::shared_ptr<const Gaussians> level_within(const fs::path& path, size_t splats, size_t budget,
                                              std::string& remark) {
    if (splats <= budget || format_of_file(path) != SplatFormat::sog_levels) return nullptr;
    std::vector<size_t> counts = level_counts(path);
    while (!counts.empty() && counts.back() == 0) counts.pop_back();
    for (size_t level = 1; level < counts.size(); ++level) {
        const bool fits = counts[level] > 0 && counts[level] <= budget;
        if (!fits && level + 1 < counts.size()) continue;
        try {
            return std::make_shared<const Gaussians>(read_splat_level(path, level).gaussians);
        } catch (const InputError& error) {
            remark += remark.empty() ? "" : "; ";
            remark += "level " + std::to_string(level) + " is not shown: " + error.what();
        }
    }
    return nullptr;
}

OpenedScene open_splats(const fs::path& path, const fs::path& cameras, size_t budget) {
    OpenedScene scene;
    SplatScene splats = read_splats(path);
    if (splats.antialiased) scene.look.kernel = Footprint::antialias;
    const bool density = splats.gaussians.density;
    if (!splats.remarks.empty()) scene.remark = splats.remarks.front();
    scene.coarse = level_within(path, splats.gaussians.size(), budget, scene.remark);
    scene.gaussians = std::make_shared<const Gaussians>(std::move(splats.gaussians));
    if (scene.gaussians->size() == 0) scene.remark = scene_title(path) + " is empty: it has no splats";
    if (!cameras.empty()) scene.dataset = load_cameras(cameras, {}, false);
    if (const auto run = folders::run_of_splats(path); run && cameras.empty() && !run->dataset.empty()) {
        scene.look = look_of(*run);
        add_cameras(scene, *run, {}, false);
    }
    if (density) scene.look.kernel = Footprint::density;
    return scene;
}

OpenedScene open_dataset(const fs::path& path) {
    OpenedScene scene;
    scene.dataset = load_cameras(path, {}, true);
    scene.gaussians = std::make_shared<const Gaussians>(splats_of_points(scene.dataset->points));
    scene.points = true;
    scene.remark = what_is(path) == What::mesh
                       ? "these are the views of a mesh scene; \"Train splats\" renders it and trains splats"
                   : scene.gaussians->size() > 0
                       ? "these are the points of the dataset; \"Train splats\" makes splats of them"
                       : "this dataset has cameras, but no points and no splats";
    return scene;
}

}  // namespace

void OpenedScene::set_gaussians(std::shared_ptr<const Gaussians> splats) {
    gaussians = std::move(splats);
    sh_degree = sh_degree_present(*gaussians);
    plan = plan_lines(*gaussians, RenderOptions{});
}

std::string scene_title(const fs::path& path) {
    const fs::path clean = path.lexically_normal();
    const std::string name = (clean.has_filename() ? clean : clean.parent_path()).filename().string();
    return name.empty() || name == "." ? path.string() : name;
}

Gaussians splats_of_points(const PointCloud& points) {
    if (points.positions.empty()) return {};
    Gaussians splats = gaussians_from_points(points, 0);
    for (float& logit : splats.opacity_logits) logit = kPointOpacity;
    for (float& scale : splats.log_scales) scale -= kPointShrink;
    return splats;
}

OpenedScene open_scene(const fs::path& path, const fs::path& cameras, size_t budget) {
    std::error_code error;
    OpenedScene scene;
    if (!fs::exists(path, error)) throw InputError(path.string() + ": no such file or folder");
    const auto run = fs::is_directory(path, error) ? folders::find_run(path) : std::nullopt;
    if (run) {
        scene = open_run(*run, cameras);
    } else if (core::is_file(path / folders::kMadeDataset / folders::kCaptureFile)) {
        return open_scene(path / folders::kMadeDataset, {});  // of photos on which nothing was trained yet
    } else if (const fs::path dataset = dataset_of_images(path); !dataset.empty()) {
        return open_scene(dataset, cameras);
    } else if (const What what = what_is(path); is_searched(what)) {
        scene.photos = path;
    } else if (fs::is_directory(path, error) || what == What::dataset || what == What::mesh) {
        scene = open_dataset(path);
    } else {
        scene = open_splats(path, cameras, budget);
    }
    if (scene.dataset) scene.supports = camera_support(*scene.dataset);
    scene.title = scene_title(path);
    scene.path = path;
    return scene;
}

bool is_dataset(const fs::path& path) {
    std::error_code error;
    if (fs::is_directory(path, error)) return !folders::find_run(path);
    const What what = what_is(path);
    return what == What::dataset || what == What::mesh;
}

OpenedScene with_cameras(const OpenedScene& splats, const OpenedScene& cameras) {
    OpenedScene scene = splats;
    scene.dataset = cameras.dataset;
    scene.supports = cameras.supports;
    scene.appearances.clear();
    scene.cameras = cameras.path;
    scene.remark = "with the cameras of ";
    scene.remark += cameras.title;
    return scene;
}

OpenedScene open_dropped(const std::vector<fs::path>& paths, const OpenedScene& shown, size_t budget) {
    const auto dataset = std::find_if(paths.begin(), paths.end(), is_dataset);
    const auto splats = std::find_if_not(paths.begin(), paths.end(), is_dataset);
    std::vector<fs::path> opened;
    OpenedScene scene;
    if (dataset != paths.end() && splats != paths.end()) {
        const OpenedScene cameras = open_scene(*dataset, {});
        if (!cameras.photos.empty()) return cameras;
        scene = with_cameras(open_scene(*splats, {}, budget), cameras);
        opened = {*splats, *dataset};
    } else if (dataset != paths.end()) {
        scene = open_scene(*dataset, {});
        opened = {*dataset};
        const bool has_splats = !shown.points && shown.gaussians->size() > 0;
        if (has_splats && shown.cameras != *dataset && scene.photos.empty()) {
            scene = with_cameras(shown, scene);
            scene.remark += "; drop it again to open the dataset itself";
        }
    } else {
        scene = open_scene(*splats, {}, budget);
        opened = {*splats};
        const bool camera_less = !scene.dataset && scene.run.empty();
        if (camera_less && shown.points && shown.dataset && shown.run.empty() && scene.gaussians->size() > 0)
            scene = with_cameras(scene, shown);
    }
    for (const fs::path& path : paths)
        if (std::find(opened.begin(), opened.end(), path) == opened.end()) {
            scene.remark += scene.remark.empty() ? "" : "; ";
            scene.remark += "one scene is shown at a time: " + scene_title(path) + " is left out";
        }
    return scene;
}

}  // namespace ewa::viewer
