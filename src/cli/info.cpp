// SPDX-License-Identifier: Apache-2.0
// ewa info: what is in a splat file or a dataset.
#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <map>
#include <memory>
#include <tuple>

#include "cli/arguments.h"
#include "cli/command.h"
#include "cli/dataset_argument.h"
#include "cli/info_mesh.h"
#include "cli/splat_statistics.h"
#include "cli/text.h"
#include "core/text.h"
#include "ewa/dataset.h"
#include "ewa/error.h"
#include "ewa/photograph.h"
#include "ewa/renderer.h"
#include "ewa/splat_files.h"
#include "ewa/trainer.h"
#include "report/summary.h"

namespace ewa::cli {
namespace {

namespace fs = std::filesystem;
using report::Json;

Json range_json(const Spread& spread) {
    return {
        {"min", spread.min}, {"median", spread.median}, {"max", spread.max}, {"histogram", spread.histogram}};
}

Json plan_json(const std::vector<PlanLine>& lines) {
    Json json = Json::array();
    for (const PlanLine& line : lines)
        json.push_back({{"what", line.what}, {"why", line.why}, {"bytes_saved", line.bytes_saved}});
    return json;
}

void print_plan(const char* title, const std::vector<PlanLine>& lines) {
    if (lines.empty()) return;
    fmt::print("left out when {}\n", title);
    for (const PlanLine& line : lines)
        fmt::print("  {}: {}{}\n", line.what, line.why,
                   line.bytes_saved > 0 ? ", saves " + bytes_text(line.bytes_saved) : "");
}

void print_spread(const char* name, const Spread& spread) {
    fmt::print("{:<16}{:.4g} .. {:.4g}, median {:.4g}  [{}]\n", name, spread.min, spread.max, spread.median,
               histogram_text(spread));
}

void print_file(const fs::path& path, const SplatScene& scene) {
    fmt::print("{}\nformat          {}{}, {}\n", core::one_line(path.string()), name_of(scene.format),
               scene.variant.empty() ? "" : " (" + scene.variant + ")", bytes_text(fs::file_size(path)));
    if (scene.antialiased) fmt::print("anti-aliased    marked so: draw it with --antialias\n");
    for (const std::string& comment : scene.comments)
        fmt::print("comment         {}\n", core::one_line(comment));
    for (const std::string& remark : scene.remarks)
        fmt::print("note            {}\n", core::one_line(remark));
}

int info_splats(const fs::path& path, bool json) {
    const SplatScene scene = read_splats(path);
    const Gaussians& gaussians = scene.gaussians;
    const SplatStatistics statistics = splat_statistics(gaussians);
    TrainOptions options;
    options.strategy = strategy_for(options.steps);
    const auto rendering = plan_lines(gaussians, RenderOptions{});
    const auto training = plan_lines(gaussians, options);
    if (json) {
        const Json out = {{"kind", "splats"},
                          {"format", name_of(scene.format)},
                          {"variant", scene.variant},
                          {"bytes", fs::file_size(path)},
                          {"antialiased", scene.antialiased},
                          {"comments", scene.comments},
                          {"notes", scene.remarks},
                          {"splats", gaussians.size()},
                          {"sh_degree", gaussians.sh_degree},
                          {"file_sh_degree", scene.file_sh_degree},
                          {"sh_degree_present", sh_degree_present(gaussians)},
                          {"bounds", {{"min", statistics.low}, {"max", statistics.high}}},
                          {"opacity", range_json(statistics.opacity)},
                          {"scale", range_json(statistics.scale)},
                          {"nonfinite", statistics.nonfinite},
                          {"plan", {{"rendering", plan_json(rendering)}, {"training", plan_json(training)}}}};
        // A file's text may be no UTF-8, which JSON is.
        fmt::print("{}\n", out.dump(2, ' ', false, Json::error_handler_t::replace));
        return 0;
    }
    print_file(path, scene);
    fmt::print("splats          {}\n", gaussians.size());
    fmt::print("SH degree       {} stored, {} present\n", gaussians.sh_degree, sh_degree_present(gaussians));
    fmt::print("bounds          ({:.6g}, {:.6g}, {:.6g}) .. ({:.6g}, {:.6g}, {:.6g})\n", statistics.low[0],
               statistics.low[1], statistics.low[2], statistics.high[0], statistics.high[1],
               statistics.high[2]);
    print_spread("opacity", statistics.opacity);
    print_spread("scale", statistics.scale);
    fmt::print("not drawn       {} (a value is not finite, or the quaternion is zero)\n",
               statistics.nonfinite);
    print_plan("rendering", rendering);
    print_plan("training", training);
    return 0;
}

const char* dataset_kind(const fs::path& path) {
    if (!fs::is_directory(path)) return "transforms";
    return fs::exists(path / "sparse") ? "COLMAP" : "transforms";
}

/// How many frames share a size and intrinsics, most common first.
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

int info_dataset(const fs::path& path, int test_every, bool json) {
    const Dataset dataset = load_cameras_as_trained(path, 1);
    const char* kind = dataset_kind(path);
    const Split split = split_frames(dataset, test_every);
    std::vector<int> every(dataset.frames.size());
    for (size_t i = 0; i < every.size(); ++i) every[i] = static_cast<int>(i);
    const double extent = every.empty() ? 0 : scene_extent(dataset, every);
    if (json) {
        fmt::print("{}\n", dataset_json(dataset, kind, split, extent).dump(2));
        return 0;
    }
    fmt::print("{}\nkind            {}\n", core::one_line(path.string()), kind);
    fmt::print("frames          {} ({} train, {} test with --test-every {})\n", dataset.frames.size(),
               split.train.size(), split.test.size(), test_every);
    if (dataset.missing_images > 0)
        fmt::print("images          {} are missing, their frames left out unless all are\n",
                   dataset.missing_images);
    print_cameras(dataset);
    fmt::print("points          {} ({} dropped: a coordinate is not finite)\n",
               dataset.points.positions.size(), dataset.dropped_points);
    if (!dataset.color_depends_on_view)
        fmt::print("colour          does not depend on the view: training leaves SH degrees 1 to {} out\n",
                   kMaxShDegree);
    fmt::print("extent          {:.6g} (1.1 times the farthest camera from the cameras' mean)\n", extent);
    return 0;
}

int run(const fs::path& path, int test_every, bool json) {
    std::error_code error;
    if (!fs::exists(path, error)) throw InputError(path.string() + ": there is no such file or folder");
    if (fs::is_directory(path) || path.extension() == ".json") return info_dataset(path, test_every, json);
    if (is_mesh_scene(path)) {
        info_mesh(path, test_every, json);
        return 0;
    }
    return info_splats(path, json);
}

}  // namespace

Action add_info(CLI::App& app) {
    struct Arguments {
        fs::path path;
        int test_every = 8;
        bool json = false;
    };
    const auto arguments = std::make_shared<Arguments>();
    app.add_option("PATH", arguments->path,
                   "A splat file (.ply .compressed.ply .splat .spz .glb .gltf), a COLMAP folder, a "
                   "transforms.json, or a "
                   "glTF of meshes")
        ->required();
    add_test_every_option(app, arguments->test_every);
    app.add_flag("--json", arguments->json, "As JSON");
    return [arguments] { return run(arguments->path, arguments->test_every, arguments->json); };
}

}  // namespace ewa::cli
