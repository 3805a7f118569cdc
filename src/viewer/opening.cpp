// SPDX-License-Identifier: Apache-2.0
#include "viewer/opening.h"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "core/folders.h"
#include "core/json.h"
#include "core/typing.h"
#include "ewa/error.h"
#include "ewa/splat_files.h"
#include "ewa/synthetic_dataset.h"

namespace ewa::viewer {
namespace {

namespace fs = std::filesystem;

constexpr float kPointOpacity = 3;             // logit
constexpr float kPointShrink = 1.2f;           // subtracted from the logarithm of a point's size
constexpr uint64_t kLargestConfig = 1u << 20;  // bytes

std::string name_of_path(const fs::path& path) {
    const fs::path clean = path.lexically_normal();
    const std::string name = (clean.has_filename() ? clean : clean.parent_path()).filename().string();
    return name.empty() || name == "." ? path.string() : name;
}

bool is_dataset_file(const fs::path& path) {
    const std::string name = path.filename().string();
    return name.starts_with("transforms") && core::lower(path.extension().string()) == ".json";
}

/// points: also load the points, which are read only together with the images.
std::shared_ptr<const Dataset> load_cameras(const fs::path& path, int downscale, bool points) {
    Dataset dataset;
    if (is_mesh_scene(path)) dataset = scene_cameras(path, {});
    try {
        if (points && dataset.frames.empty()) dataset = load_dataset(path, {.downscale = downscale});
    } catch (const InputError&) {
        // An image or the points are invalid: the cameras alone may still load.
    }
    if (dataset.frames.empty()) dataset = load_dataset(path, {.downscale = downscale, .need_images = false});
    // Skip frames without an image, unless all are, as training and `ewa render` do.
    const auto missing = [](const Frame& frame) { return !frame.image_exists; };
    if (!std::all_of(dataset.frames.begin(), dataset.frames.end(), missing))
        std::erase_if(dataset.frames, missing);
    if (dataset.frames.empty()) throw InputError(path.string() + " has no frames");
    return std::make_shared<const Dataset>(std::move(dataset));
}

nlohmann::json read_config(const fs::path& path) {
    try {
        const auto json = core::read_json_file<nlohmann::json>(path, {.bytes = kLargestConfig});
        if (json.is_object()) return json;
    } catch (const InputError&) {
        // The run is shown without its settings.
    }
    return nlohmann::json::object();
}

std::string text_of(const nlohmann::json& config, const char* name) {
    const auto found = config.find(name);
    return found != config.end() && found->is_string() ? found->get<std::string>() : std::string();
}

Look look_of(const nlohmann::json& config) {
    Look look;
    const std::string kernel = text_of(config, "kernel");
    if (kernel == "antialias") look.kernel = Footprint::antialias;
    if (kernel == "ewa") look.kernel = Footprint::unit_mass;
    look.background = core::parse_colour(text_of(config, "background")).value_or(look.background);
    return look;
}

/// The dataset that config.json names, relative to the folder where the training was started: the current one
/// or any folder above the run. Of a mesh scene: the images that the training rendered.
fs::path dataset_of(const fs::path& run, const nlohmann::json& config) {
    const fs::path named = text_of(config, "dataset");
    if (named.empty()) return {};
    std::error_code error;
    const std::string extension = core::lower(named.extension().string());
    const bool mesh = extension == ".gltf" || extension == ".glb";
    if (mesh && fs::exists(run / "dataset/transforms.json", error)) return run / "dataset";
    if (fs::exists(named, error)) return named;
    if (named.is_absolute()) return {};
    for (fs::path folder = fs::absolute(run, error); folder.has_relative_path();
         folder = folder.parent_path())
        if (fs::exists(folder / named, error)) return folder / named;
    return {};
}

/// Whether the folder is that of a training run, also of one that has just begun.
bool is_run(const fs::path& path) {
    const auto present = [&](const char* name) { return core::is_file(path / name); };
    return present("config.json") || present("splats.ply") || present("metrics.jsonl");
}

OpenedScene open_run(const fs::path& run, const fs::path& cameras) {
    OpenedScene scene;
    scene.run = run;
    const nlohmann::json config = read_config(run / "config.json");
    scene.look = look_of(config);
    std::error_code error;
    const bool splats = fs::exists(run / "splats.ply", error);
    if (splats) {
        scene.splats_time = fs::last_write_time(run / "splats.ply", error);
        scene.gaussians = std::make_shared<const Gaussians>(load_splats(run / "splats.ply"));
    }
    const fs::path dataset = cameras.empty() ? dataset_of(run, config) : cameras;
    const auto downscale = config.find("downscale");
    const int factor = downscale != config.end() && downscale->is_number_integer()
                           ? std::clamp(downscale->get<int>(), 1, 1024)
                           : 1;
    try {
        if (!dataset.empty())
            scene.dataset = load_cameras(dataset, factor, !splats);
        else
            scene.remark = "the dataset of this run was not found; name it with --cameras DATASET";
    } catch (const InputError& problem) {
        if (!cameras.empty()) throw;
        scene.remark = problem.what();
    }
    if (!splats && scene.dataset)
        scene.gaussians = std::make_shared<const Gaussians>(splats_of_points(scene.dataset->points));
    return scene;
}

OpenedScene open_dataset(const fs::path& path) {
    OpenedScene scene;
    scene.dataset = load_cameras(path, 1, true);
    scene.gaussians = std::make_shared<const Gaussians>(splats_of_points(scene.dataset->points));
    scene.remark = is_mesh_scene(path)
                       ? "these are the views of a mesh scene; ewa train renders it and trains splats"
                   : scene.gaussians->size() > 0
                       ? "these are the points of the dataset; ewa train trains splats from them"
                       : "this dataset has cameras, but no points and no splats";
    return scene;
}

}  // namespace

void OpenedScene::set_gaussians(std::shared_ptr<const Gaussians> splats) {
    gaussians = std::move(splats);
    sh_degree = sh_degree_present(*gaussians);
    plan = plan_lines(*gaussians, RenderOptions{});
}

Gaussians splats_of_points(const PointCloud& points) {
    if (points.positions.empty()) return {};
    Gaussians splats = gaussians_from_points(points, 0);
    for (float& logit : splats.opacity_logits) logit = kPointOpacity;
    for (float& scale : splats.log_scales) scale -= kPointShrink;
    return splats;
}

OpenedScene open_scene(const fs::path& path, const fs::path& cameras) {
    std::error_code error;
    OpenedScene scene;
    if (!fs::exists(path, error)) throw InputError(path.string() + ": no such file or folder");
    if (fs::is_directory(path, error)) {
        scene = is_run(path) ? open_run(path, cameras) : open_dataset(path);
    } else if (is_dataset_file(path) || is_mesh_scene(path)) {
        scene = open_dataset(path);
    } else {
        SplatScene splats = read_splats(path);
        if (splats.antialiased) scene.look.kernel = Footprint::antialias;
        if (!splats.remarks.empty()) scene.remark = splats.remarks.front();
        scene.gaussians = std::make_shared<const Gaussians>(std::move(splats.gaussians));
        if (!cameras.empty()) scene.dataset = load_cameras(cameras, 1, false);
    }
    scene.title = name_of_path(path);
    return scene;
}

}  // namespace ewa::viewer
