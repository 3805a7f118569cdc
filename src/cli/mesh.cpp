// SPDX-License-Identifier: Apache-2.0
// ewa mesh: the surfaces of a splat scene as a mesh, from the depth that the cameras of its run see.
#include <spdlog/fmt/fmt.h>
#include <unistd.h>
#include <CLI/CLI.hpp>

#include <algorithm>
#include <cmath>
#include <glm/mat3x3.hpp>
#include <memory>
#include <numbers>
#include <optional>

#include "cli/arguments.h"
#include "cli/command.h"
#include "cli/convert_edits.h"
#include "cli/interrupt.h"
#include "cli/output.h"
#include "cli/run_inputs.h"
#include "core/text.h"
#include "core/typing.h"
#include "ewa/error.h"
#include "ewa/renderer.h"
#include "io/datasets/dataset_folders.h"
#include "io/datasets/refined_cameras.h"
#include "mesh/colors.h"
#include "mesh/depth_cache.h"
#include "mesh/fusion.h"
#include "mesh/mesh_files.h"
#include "mesh/meshing.h"
#include "mesh/parts.h"
#include "run/loss_option.h"
#include "scene/dataset_files.h"
#include "scene/framing.h"
#include "scene/readout.h"

namespace ewa::cli {
namespace {

namespace fs = std::filesystem;

struct MeshArguments {
    fs::path splats, cameras, output;
    std::string scale_to;
    double voxel = 0;   // 0: not given
    int triangles = 0;  // 0: not given
    int downscale = 1, max_width = 0;
    std::string depth = "auto";  // or median, mean
    bool unbounded = false, collision = false;
    DeviceOptions device;
    bool quiet = false;
};

constexpr int kOwnViews = 64, kOwnViewSide = 512;
/// A part that is smaller than this was seen within the truncation alone.
constexpr double kLeastPart = 4 * mesh::kTruncation;  // voxels
/// A collision mesh: its voxels in usual ones, and its triangles unless --triangles says another number.
constexpr double kCollisionVoxels = 4;
constexpr size_t kCollisionTriangles = 10000;

/// Around the scene from all directions, for splats whose cameras are not known.
std::vector<Camera> own_cameras(const Gaussians& gaussians) {
    const scene::Framing framing = scene::frame_scene(gaussians, kOwnViewSide, kOwnViewSide);
    const double distance = glm::length(framing.camera.position() - framing.target);
    std::vector<Camera> cameras;
    for (int i = 0; i < kOwnViews; ++i) {  // on Fibonacci's spiral
        const double z = 1 - (2 * i + 1.0) / kOwnViews, turn = i * std::numbers::pi * (3 - std::sqrt(5.0));
        const glm::dvec3 to(std::sqrt(1 - z * z) * std::cos(turn), std::sqrt(1 - z * z) * std::sin(turn), z);
        cameras.push_back(scene::look_at(framing.target + distance * to, framing.target, framing.up,
                                         kOwnViewSide, kOwnViewSide));
    }
    return cameras;
}

/// The six sides of a cube about the camera of a 360° image, with its pixels per degree in their middles. They overlap: a side sees
/// nothing between its last pixel's centre and its border.
void add_cube(const Camera& around, std::vector<Camera>& cameras) {
    constexpr int kOverlap = 2;  // px
    Camera side;
    const int length = std::max(1, int(std::lround(2 * around.fx)));
    side.width = side.height = length + 2 * kOverlap;
    side.fx = side.fy = 0.5 * length;
    side.cx = side.cy = 0.5 * side.width;
    constexpr double kTurns[] = {0, 0.25, 0.5, 0.75};
    const auto add = [&](double turn, double nod) {
        const double a = 2 * std::numbers::pi * turn, b = 2 * std::numbers::pi * nod;
        const glm::dmat3 about_y(std::cos(a), 0, std::sin(a), 0, 1, 0, -std::sin(a), 0, std::cos(a));
        const glm::dmat3 about_x(1, 0, 0, 0, std::cos(b), -std::sin(b), 0, std::sin(b), std::cos(b));
        side.rotation = about_x * about_y * around.rotation;
        side.translation = about_x * about_y * around.translation;
        cameras.push_back(side);
    };
    for (const double turn : kTurns) add(turn, 0);
    for (const double nod : {0.25, 0.75}) add(0, nod);
}

std::vector<Camera> cameras_of(const Dataset& dataset) {
    std::vector<Camera> cameras;
    for (const Frame& frame : dataset.frames) {
        if (frame.camera.distortion.lens == Lens::equirectangular) {
            add_cube(frame.camera, cameras);
            continue;
        }
        if (!frame.camera.distortion.none())
            throw InputError("a mesh needs pinholes or 360 degree images, and " + core::one_line(frame.name) +
                             " has parallel rays; name other cameras with --cameras");
        if (scene::moves(frame.camera))
            throw InputError("a mesh needs cameras at rest, and " + core::one_line(frame.name) +
                             " has a rolling shutter");
        cameras.push_back(frame.camera);
    }
    return cameras;
}

/// The cameras of --cameras or of the run, refined as the run refined them. Empty without both.
std::optional<Dataset> dataset_of_mesh(const MeshArguments& arguments, const std::optional<live::Run>& run) {
    fs::path path = arguments.cameras;
    if (path.empty() && run) path = dataset_of(*run);
    if (path.empty()) return std::nullopt;
    Dataset dataset = load_cameras_as_trained(
        dataset_input(path),
        {.downscale = arguments.downscale, .max_width = arguments.max_width, .lens = LensUse::automatic});
    const fs::path refined = arguments.cameras.empty() ? refined_cameras_of(*run) : fs::path();
    if (!refined.empty()) io::use_refined_cameras(dataset, refined);
    return dataset;
}

void check_output(const MeshArguments& arguments, const std::optional<Dataset>& dataset) {
    mesh::check_mesh_name(arguments.output);
    io::check_not_inside_dataset("-o", fs::absolute(arguments.output).parent_path());
    std::vector<NamedFile> read{{"SPLATS", arguments.splats}, {"--cameras", arguments.cameras}};
    if (dataset) {
        const std::vector<NamedFile> more = scene::files_of(*dataset, "the dataset");
        read.insert(read.end(), more.begin(), more.end());
    }
    check_command_outputs({{"the mesh", arguments.output}}, read);
}

/// Whether the surfaces are at the mean depth of the splats, which --loss depth brings onto them; else at the median depth.
bool at_mean_depth(const MeshArguments& arguments, const std::optional<live::Run>& run) {
    if (arguments.depth != "auto") return arguments.depth == "mean";
    const std::string loss = run ? run->text("loss") : "";
    return !loss.empty() && train::parse_loss(loss).depth > 0;
}

/// The mean depth where the splats take at least half of the light; elsewhere 0.
Image solid_mean_depth(const Rendering& seen) {
    constexpr float kSolid = 0.5f;
    Image depth = seen.depth;
    for (size_t i = 0; i < depth.pixels.size(); ++i)
        if (!(seen.alpha.pixels[i] >= kSolid)) depth.pixels[i] = 0;
    return depth;
}

/// Half of the machine's memory.
uint64_t memory_for_volume() {
    return uint64_t(sysconf(_SC_PHYS_PAGES)) * uint64_t(sysconf(_SC_PAGESIZE)) / 2;
}

mesh::FusionOptions fusion_options(const MeshArguments& arguments) {
    mesh::FusionOptions options{.voxel = arguments.voxel,
                                .unbounded = arguments.unbounded,
                                .closed = arguments.collision,
                                .least_part = kLeastPart,
                                .most_triangles = size_t(arguments.triangles),
                                .most_bytes = memory_for_volume()};
    if (arguments.collision) {
        options.coarser = kCollisionVoxels;
        if (arguments.triangles == 0) options.most_triangles = kCollisionTriangles;
    }
    return options;
}

void enlarge(mesh::Fused& fused, double scale) {
    if (scale == 1) return;
    fused.mesh.origin *= scale;
    for (glm::vec3& p : fused.mesh.positions) {
        const glm::dvec3 to = scale * glm::dvec3(p);
        p = glm::vec3(to);
        if (!(glm::length(to) <= double(std::numeric_limits<float>::max())))
            throw InputError(
                fmt::format("--scale-to: {:g} times as large, the mesh is too large for its numbers", scale));
    }
    fused.voxel *= scale;
    fused.space.radius *= scale;
}

void print(const mesh::Fused& fused, const MeshArguments& arguments, size_t most, Progress& progress) {
    const size_t triangles = fused.mesh.triangles.size();
    const mesh::Topology topology = mesh::topology_of(fused.mesh);
    std::string voxels = fmt::format("voxels of {:.4g}", fused.voxel);
    if (arguments.unbounded) voxels += fmt::format(" within {:.4g} of the middle", fused.space.radius);
    progress.note(fmt::format("{}: {} in {}, {}, {}", core::one_line(arguments.output.string()),
                              core::counted(triangles, "triangle"), core::counted(topology.parts, "part"),
                              voxels, mesh::watertight_text(topology)));
    if (most > 0 && triangles > most)
        progress.note(fmt::format("{} {}: with fewer than {}, the surface would tear",
                                  arguments.triangles > 0 ? "--triangles" : "--collision with at most", most,
                                  triangles));
}

int make_mesh(const MeshArguments& arguments, const std::optional<live::Run>& run) {
    RenderOptions options;
    const DrawArguments draw;
    const double scale = arguments.scale_to.empty() ? 1 : parse_scale_to(arguments.scale_to);
    const Gaussians gaussians = draw.load(arguments.splats, options);
    const std::optional<Dataset> dataset = dataset_of_mesh(arguments, run);
    check_output(arguments, dataset);
    const std::vector<Camera> cameras = dataset ? cameras_of(*dataset) : own_cameras(gaussians);
    mesh::meshing();  // says at once that it is missing

    Renderer renderer(open_device(arguments.device), gaussians, options);
    const InterruptWatch watch;
    Progress progress("meshed", int((arguments.collision ? 2 : 3) * cameras.size()), "views",
                      arguments.quiet);
    const auto done = [&](size_t steps) {
        if (interrupted()) throw Interrupted();
        progress.update(int(steps));
    };
    const bool mean = at_mean_depth(arguments, run);
    mesh::DepthCache cache(cameras.size(), [&](size_t i) {
        if (mean) return solid_mean_depth(renderer.render(cameras[i], Drawing::depth));
        return renderer.render(cameras[i], Drawing::median_depth).median_depth;
    });
    const mesh::DepthOfView depth = [&](size_t i) -> const Image& { return cache.at(i); };
    const mesh::FusionOptions fusion = fusion_options(arguments);
    mesh::Fused fused = mesh::fuse(cameras, depth, fusion, done);
    scene::TriangleMesh& made = fused.mesh;
    if (made.triangles.empty())
        throw InputError(
            fmt::format("no surface is as large as {:g} voxels of {:.3g}; take a smaller --voxel", kLeastPart,
                        fused.voxel));
    mesh::set_normals(made);
    if (!arguments.collision)
        mesh::set_colors(
            made, cameras, depth, [&](size_t i) { return renderer.render(cameras[i]).color; },
            [&](const glm::dvec3& at) { return mesh::kTruncation * fused.voxel_at(at); },
            [&](size_t views) { done(2 * cameras.size() + views); });
    enlarge(fused, scale);
    make_folder(arguments.output.parent_path());
    mesh::save_mesh(arguments.output, made);
    print(fused, arguments, fusion.most_triangles, progress);
    return 0;
}

int run(CLI::App& app, MeshArguments& arguments) {
    SplatInput input = splat_input(arguments.splats);
    arguments.splats = input.file;
    if (!input.run) input.run = live::run_of_splats(arguments.splats);
    if (input.run && input.run->flag("points"))
        throw InputError(core::one_line(arguments.splats.string()) +
                         " holds the spheres of --points, which have no surfaces");
    if (input.run) use_options_of(*input.run, app);
    return make_mesh(arguments, input.run);
}

}  // namespace

Action add_mesh(CLI::App& app) {
    const auto arguments = std::make_shared<MeshArguments>();
    add_splats(app, arguments->splats);
    app.add_option("-o,--output", arguments->output, "The mesh (.ply, .obj, .glb)")
        ->required()
        ->type_name("OUT");
    app.add_option("--cameras", arguments->cameras,
                   "Dataset whose cameras see the surfaces [that of the run; without a run, cameras all "
                   "around the splats]")
        ->type_name("DATASET");
    app.add_option("--voxel", arguments->voxel,
                   "Distance of the mesh's vertices, in the scene's units [two pixels on the surfaces]")
        ->transform(in_range(1e-12, 1e12))
        ->type_name("SIZE");
    app.add_option("--triangles", arguments->triangles,
                   "At most this many triangles, where the surface needs no more to hang together [all]")
        ->transform(in_range(4, 1000000000))
        ->type_name("N");
    app.add_option(
           "--depth", arguments->depth,
           "Where a pixel's surface is: at the median or the mean depth of its splats. auto: the mean if the "
           "run compared it with depth maps (--loss depth=W), else the median")
        ->transform(one_of({"auto", "median", "mean"}))
        ->type_name("auto|median|mean")
        ->capture_default_str();
    app.add_flag(
        "--unbounded", arguments->unbounded,
        "Also mesh the background, with voxels that grow with the distance from what the cameras look at");
    app.add_flag("--collision", arguments->collision,
                 "A mesh for physics: closed, coarse, of at most 10,000 triangles, without colours");
    app.add_option(
           "--scale-to", arguments->scale_to,
           "Scale the mesh until these two points of the scene are LENGTH apart. ewa-view measures points")
        ->type_name("x,y,z,X,Y,Z,LENGTH");
    add_size_options(app, arguments->downscale, arguments->max_width);
    add_device_options(app, arguments->device);
    add_quiet_option(app, arguments->quiet);
    return [&app, arguments] { return run(app, *arguments); };
}

}  // namespace ewa::cli
