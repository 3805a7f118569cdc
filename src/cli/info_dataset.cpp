// SPDX-License-Identifier: Apache-2.0
#include "cli/info_dataset.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <map>
#include <nlohmann/json.hpp>
#include <tuple>
#include <vector>

#include "cli/dataset_argument.h"
#include "core/messages.h"
#include "core/text.h"
#include "ewa/synthetic_dataset.h"
#include "io/gltf/mesh.h"
#include "report/summary.h"

namespace ewa::cli {
namespace {

namespace fs = std::filesystem;
using report::Json;

const char* dataset_kind(const fs::path& path) {
    if (!fs::is_directory(path)) return "transforms";
    return fs::exists(path / "sparse") ? "COLMAP" : "transforms";
}

/// The frames that share a size and intrinsics.
struct CameraGroup {
    int frames = 0;
    Camera camera;
    bool distorted = false;
};
std::vector<CameraGroup> camera_groups(const Dataset& dataset) {
    std::map<std::tuple<int, int, double, double, double, double, bool>, CameraGroup> groups;
    for (const Frame& frame : dataset.frames) {
        const Camera& c = frame.camera;
        const bool distorted = !frame.distortion.none();
        CameraGroup& group = groups[{c.width, c.height, c.fx, c.fy, c.cx, c.cy, distorted}];
        group.camera = c;
        group.distorted = distorted;
        ++group.frames;
    }
    std::vector<CameraGroup> list;
    for (const auto& [key, group] : groups) list.push_back(group);
    std::stable_sort(list.begin(), list.end(), [](auto& a, auto& b) { return a.frames > b.frames; });
    return list;
}

Json dataset_json(const Dataset& dataset, const char* kind, const Split& split, double extent) {
    Json cameras = Json::array();
    for (const CameraGroup& group : camera_groups(dataset))
        cameras.push_back({{"frames", group.frames},
                           {"width", group.camera.width},
                           {"height", group.camera.height},
                           {"fx", group.camera.fx},
                           {"fy", group.camera.fy},
                           {"cx", group.camera.cx},
                           {"cy", group.camera.cy},
                           {"distorted", group.distorted}});
    return {{"kind", kind},
            {"frames", dataset.frames.size()},
            {"missing_images", dataset.missing_images},
            {"cameras", cameras},
            {"points", dataset.points.positions.size()},
            {"dropped_points", dataset.dropped_points},
            {"color_depends_on_view", dataset.color_depends_on_view},
            {"extent", extent},
            {"train", split.train.size()},
            {"test", split.test.size()}};
}

void print_cameras(const Dataset& dataset) {
    constexpr size_t kShown = 4;
    const auto groups = camera_groups(dataset);
    for (size_t i = 0; i < std::min(kShown, groups.size()); ++i) {
        const Camera& c = groups[i].camera;
        fmt::print("{:<16}{}x{}, fx {:.6g}, fy {:.6g}, cx {:.6g}, cy {:.6g}{} ({} frames)\n",
                   i == 0 ? "cameras" : "", c.width, c.height, c.fx, c.fy, c.cx, c.cy,
                   groups[i].distorted ? ", undistorted on loading" : "", groups[i].frames);
    }
    if (groups.size() > kShown) fmt::print("{:<16}and {} more\n", "", groups.size() - kShown);
}

}  // namespace

void info_dataset(const fs::path& path, int test_every, bool json) {
    const Dataset dataset = load_cameras_as_trained(path, 1);
    const char* kind = dataset_kind(path);
    const Split split = split_frames(dataset, test_every);
    std::vector<int> every(dataset.frames.size());
    for (size_t i = 0; i < every.size(); ++i) every[i] = static_cast<int>(i);
    const double extent = every.empty() ? 0 : scene_extent(dataset, every);
    if (json) {
        fmt::print("{}\n", dataset_json(dataset, kind, split, extent).dump(2));
        return;
    }
    fmt::print("{}\nkind            {}\n", core::one_line(path.string()), kind);
    fmt::print("frames          {} ({} train, {} test with --test-every {})\n", dataset.frames.size(),
               split.train.size(), split.test.size(), test_every);
    if (dataset.missing_images > 0)
        fmt::print("images          {} missing; their frames are skipped unless all images are missing\n",
                   dataset.missing_images);
    print_cameras(dataset);
    fmt::print("points          {} ({} dropped: a coordinate is not finite)\n",
               dataset.points.positions.size(), dataset.dropped_points);
    if (!dataset.color_depends_on_view)
        fmt::print("colour          does not depend on the view: training skips SH degrees 1 to {}\n",
                   kMaxShDegree);
    fmt::print("extent          {:.6g} (1.1 times the largest distance of a camera from their mean)\n",
               extent);
}

void info_mesh(const fs::path& path, int test_every, bool json) {
    const scene::MeshScene scene = io::read_gltf_mesh(path);
    const Dataset views = scene_cameras(path, {});
    const Split split = split_frames(views, test_every);
    const scene::Box box = scene::bounds_of(scene);
    const auto bytes = fs::file_size(path);
    // The last material is the default of triangles that name none.
    const size_t materials = scene.materials.size() - 1;
    if (json) {
        const Json out = {
            {"kind", "mesh scene"},
            {"bytes", bytes},
            {"triangles", scene.triangles.size()},
            {"dropped_triangles", scene.dropped_triangles},
            {"materials", materials},
            {"textures", scene.textures.size()},
            {"images", scene.images.size()},
            {"lights", scene.lights.size()},
            {"cameras", scene.cameras.size()},
            {"bounds",
             {{"min", {box.low.x, box.low.y, box.low.z}}, {"max", {box.high.x, box.high.y, box.high.z}}}},
            {"views", views.frames.size()},
            {"train", split.train.size()},
            {"test", split.test.size()},
            {"color_depends_on_view", views.color_depends_on_view},
            {"notes", scene.remarks}};
        fmt::print("{}\n", out.dump(2, ' ', false, Json::error_handler_t::replace));
        return;
    }
    fmt::print("{}\nkind            mesh scene (glTF), {}\n", core::one_line(path.string()),
               core::bytes_text(bytes));
    for (const std::string& remark : scene.remarks)
        fmt::print("note            {}\n", core::one_line(remark));
    fmt::print("triangles       {} ({} more are skipped: a corner is not finite)\n", scene.triangles.size(),
               scene.dropped_triangles);
    fmt::print("materials       {}, with {} textures of {} images\n", materials, scene.textures.size(),
               scene.images.size());
    fmt::print("lights          {}, and the sky\n", scene.lights.size());
    fmt::print("bounds          ({:.6g}, {:.6g}, {:.6g}) .. ({:.6g}, {:.6g}, {:.6g})\n", box.low.x, box.low.y,
               box.low.z, box.high.x, box.high.y, box.high.z);
    fmt::print("views           {} of {} ({} train, {} test with --test-every {})\n", views.frames.size(),
               views.frames.size() == scene.cameras.size() ? "the file's cameras" : "a dome over it",
               split.train.size(), split.test.size(), test_every);
    fmt::print("colour          {}\n", views.color_depends_on_view
                                           ? "depends on the view"
                                           : "every material is diffuse: training skips SH degrees 1 to 3");
}

}  // namespace ewa::cli
