// SPDX-License-Identifier: Apache-2.0
// ewa mesh: the surfaces of a splat scene as a mesh, from the depth that the cameras of its run see.
#include <spdlog/fmt/fmt.h>
#include <unistd.h>
#include <CLI/CLI.hpp>

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/gtc/matrix_transform.hpp>
#include <glm/mat3x3.hpp>
#include <memory>
#include <numbers>
#include <optional>
#include <span>

#include "cli/arguments.h"
#include "cli/command.h"
#include "cli/convert_edits.h"
#include "cli/interrupt.h"
#include "cli/output.h"
#include "cli/render_views.h"
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
#include "mesh/pinholes.h"
#include "run/loss_option.h"
#include "scene/dataset_files.h"
#include "scene/framing.h"
#include "scene/splat_shape.h"

namespace ewa::cli {
namespace {

namespace fs = std::filesystem;

struct MeshArguments {
    fs::path splats, cameras, output;
    std::string scale_to, up;
    std::vector<std::string> transform;
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
mesh::Pinholes own_cameras(const Gaussians& gaussians) {
    const scene::Framing framing = scene::frame_scene(gaussians, kOwnViewSide, kOwnViewSide);
    const double distance = glm::length(framing.camera.position() - framing.target);
    std::vector<Camera> cameras;
    for (int i = 0; i < kOwnViews; ++i) {  // on Fibonacci's spiral
        const double z = 1 - (2 * i + 1.0) / kOwnViews, turn = i * std::numbers::pi * (3 - std::sqrt(5.0));
        const glm::dvec3 to(std::sqrt(1 - z * z) * std::cos(turn), std::sqrt(1 - z * z) * std::sin(turn), z);
        cameras.push_back(scene::look_at(framing.target + distance * to, framing.target, framing.up,
                                         kOwnViewSide, kOwnViewSide));
    }
    return mesh::Pinholes(std::move(cameras));
}

/// The cameras of --cameras or of the run, refined as the run refined them. Empty without both.
std::optional<Dataset> dataset_of_mesh(const MeshArguments& arguments, const std::optional<live::Run>& run) {
    fs::path path = arguments.cameras;
    if (path.empty() && run) path = dataset_of(*run);
    if (path.empty()) return std::nullopt;
    const bool own = run && arguments.cameras.empty();
    const LensUse lens = own && run->text("lens") == "native" ? LensUse::native : LensUse::automatic;
    Dataset dataset = load_cameras_as_trained(
        dataset_input(path),
        {.downscale = arguments.downscale, .max_width = arguments.max_width, .lens = lens});
    const fs::path refined = own ? refined_cameras_of(*run) : fs::path();
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

/// From --transform and --scale-to.
glm::dmat4 placement_of(const MeshArguments& arguments) {
    const glm::dmat4 transform = parse_transform(arguments.transform);
    if (arguments.scale_to.empty()) return transform;
    return glm::scale(glm::dmat4(1.0), glm::dvec3(parse_scale_to(arguments.scale_to, transform))) * transform;
}

void place(mesh::Fused& fused, const glm::dmat4& placement) {
    if (placement == glm::dmat4(1.0)) return;
    mesh::transform_mesh(fused.mesh, placement);
    const double scale = std::cbrt(std::abs(glm::determinant(glm::dmat3(placement))));
    fused.voxel *= scale;
    fused.space.radius *= scale;
}

/// Says where nobody chose voxels that are too large to show the scene.
void note_coarse_voxels(const mesh::Fused& fused, const MeshArguments& arguments, Progress& progress) {
    constexpr double kFew = 60, kMany = 200;  // voxels from corner to corner
    if (arguments.voxel > 0 || arguments.collision) return;
    glm::vec3 low(fused.mesh.positions.at(0)), high(low);
    for (const glm::vec3& p : fused.mesh.positions) {
        low = glm::min(low, p);
        high = glm::max(high, p);
    }
    const double voxels = double(glm::length(high - low)) / fused.voxel;
    if (voxels < kFew)
        progress.note(fmt::format(
            "voxels of {:.3g}, two pixels of the images, are coarse: the mesh is {:.0f} of them from "
            "corner to corner; --voxel {:.1g} makes it {:.0f}",
            fused.voxel, voxels, voxels * fused.voxel / kMany, kMany));
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
    const glm::dmat4 placement = placement_of(arguments);
    scene::check_transform(placement);
    const std::optional<glm::dvec3> up = parse_up(arguments.up);
    if (up && core::lower(arguments.output.extension().string()) == ".ply")
        throw InputError("--up is for .glb and .obj, whose y points up; --transform turns a .ply");
    const Gaussians gaussians = draw.load(arguments.splats, options);
    const std::optional<Dataset> dataset = dataset_of_mesh(arguments, run);
    check_output(arguments, dataset);
    // The splats of a run have seen no more than its images.
    const mesh::Pinholes pinholes =
        dataset ? mesh::Pinholes(*dataset, !run || !arguments.cameras.empty()) : own_cameras(gaussians);
    const std::span<const Camera> cameras = pinholes.cameras();
    mesh::meshing();  // says at once that it is missing

    end_on_signals();
    Renderer renderer(open_device(arguments.device), gaussians, options);
    Progress progress("meshed", int((arguments.collision ? 2 : 3) * cameras.size()), "views",
                      arguments.quiet);
    const auto done = [&](size_t steps) { progress.update(int(steps)); };
    const bool mean = at_mean_depth(arguments, run);
    mesh::DepthCache cache(cameras.size(), [&](size_t i) {
        Image seen = mean ? solid_mean_depth(renderer.render(cameras[i], Drawing::depth))
                          : renderer.render(cameras[i], Drawing::median_depth).median_depth;
        pinholes.cut(i, seen);
        return seen;
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
    note_coarse_voxels(fused, arguments, progress);
    place(fused, placement);
    make_folder(arguments.output.parent_path());
    mesh::save_mesh(arguments.output, made, up.value_or(glm::dvec3(0, -1, 0)));
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
    if (input.run) use_options_of(*input.run, app, arguments.cameras);
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
    add_transform_option(app, arguments->transform, "Of the mesh");
    app.add_option(
           "--up", arguments->up,
           "Axis of the scene that becomes y in a .glb or .obj: x, y, z, or the opposite [-y, as for splats "
           "in a .glb]")
        ->type_name("AXIS");
    app.add_option(
           "--scale-to", arguments->scale_to,
           "Scale the mesh until these two points of the scene are LENGTH apart; they are its points before "
           "--transform. ewa-view measures points")
        ->type_name("x,y,z,X,Y,Z,LENGTH");
    add_size_options(app, arguments->downscale, arguments->max_width);
    add_device_options(app, arguments->device);
    add_quiet_option(app, arguments->quiet);
    return [&app, arguments] { return run(app, *arguments); };
}

}  // namespace ewa::cli
