// SPDX-License-Identifier: Apache-2.0
// ewa mesh: the surfaces of a splat scene as a mesh, from the depth that the cameras of its run see.
#include <spdlog/fmt/fmt.h>
#include <CLI/CLI.hpp>

#include <glm/gtc/matrix_transform.hpp>
#include <memory>
#include <optional>

#include "cli/arguments.h"
#include "cli/command.h"
#include "cli/interrupt.h"
#include "cli/output.h"
#include "cli/render_views.h"
#include "cli/run_inputs.h"
#include "core/text.h"
#include "core/typing.h"
#include "edit/steps.h"
#include "ewa/error.h"
#include "ewa/renderer.h"
#include "io/datasets/dataset_folders.h"
#include "io/datasets/refined_cameras.h"
#include "mesh/mesh_files.h"
#include "mesh/parts.h"
#include "mesh/pinholes.h"
#include "mesh/scene_mesh.h"
#include "run/loss_option.h"
#include "scene/dataset_files.h"
#include "scene/splat_shape.h"

namespace ewa::cli {
namespace {

namespace fs = std::filesystem;

struct MeshArguments {
    fs::path splats, cameras, output;
    std::string scale_to, up;
    std::vector<std::string> transform;
    double voxel = 0;            // 0: not given
    int triangles = 0;           // 0: not given
    RunOptions of_cameras;       // --downscale and --max-width
    std::string depth = "auto";  // or median, mean
    bool unbounded = false, collision = false;
    DeviceOptions device;
    bool quiet = false;
};

/// The cameras of --cameras or of the run, refined as the run refined them. Empty without both.
std::optional<Dataset> dataset_of_mesh(const MeshArguments& arguments,
                                       const std::optional<folders::Run>& run) {
    fs::path path = arguments.cameras;
    if (path.empty() && run) path = dataset_of(*run);
    if (path.empty()) return std::nullopt;
    const bool own = run && arguments.cameras.empty();
    RunOptions options = arguments.of_cameras;
    if (own && run->text("lens") == "native") options.lens = LensUse::native;
    Dataset dataset = load_cameras_as_trained(dataset_input(path), options);
    const fs::path refined = own ? refined_cameras_of(*run) : fs::path();
    if (!refined.empty()) io::use_refined_cameras(dataset, refined);
    return dataset;
}

void check_output(const CLI::App& app, const MeshArguments& arguments,
                  const std::optional<Dataset>& dataset) {
    mesh::check_mesh_name(arguments.output);
    io::check_not_inside_dataset("-o", fs::absolute(arguments.output).parent_path());
    check_typed_outputs(app, {},
                        dataset ? scene::files_of(*dataset, "the dataset") : std::vector<NamedFile>());
}

/// Whether the surfaces are at the mean depth of the splats, which --loss depth brings onto them; else at the median depth.
bool at_mean_depth(const MeshArguments& arguments, const std::optional<folders::Run>& run) {
    if (arguments.depth != "auto") return arguments.depth == "mean";
    const std::string loss = run ? run->text("loss") : "";
    return !loss.empty() && train::parse_loss(loss).depth > 0;
}

/// From --transform and --scale-to.
glm::dmat4 placement_of(const MeshArguments& arguments) {
    const glm::dmat4 transform = edit::parse_transform(arguments.transform);
    if (arguments.scale_to.empty()) return transform;
    return glm::scale(glm::dmat4(1.0), glm::dvec3(edit::parse_scale_to(arguments.scale_to, transform))) *
           transform;
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

int make_mesh(const CLI::App& app, const MeshArguments& arguments, const std::optional<folders::Run>& run) {
    RenderOptions options;
    const DrawArguments draw;
    const glm::dmat4 placement = placement_of(arguments);
    scene::check_transform(placement);
    const std::optional<glm::dvec3> up = parse_up(arguments.up);
    if (up && core::lower(arguments.output.extension().string()) == ".ply")
        throw InputError("--up is for .glb and .obj, whose y points up; --transform turns a .ply");
    const Gaussians gaussians = draw.load(arguments.splats, options);
    const std::optional<Dataset> dataset = dataset_of_mesh(arguments, run);
    check_output(app, arguments, dataset);
    // The splats of a run have seen no more than its images.
    const mesh::Pinholes pinholes = dataset ? mesh::Pinholes(*dataset, !run || !arguments.cameras.empty())
                                            : mesh::cameras_around(gaussians);

    end_on_signals();
    Renderer renderer(open_device(arguments.device), gaussians, options);
    const mesh::SceneMeshOptions made_as{.voxel = arguments.voxel,
                                         .triangles = size_t(arguments.triangles),
                                         .mean_depth = at_mean_depth(arguments, run),
                                         .unbounded = arguments.unbounded,
                                         .collision = arguments.collision,
                                         .placement = placement};
    Progress progress("meshed", int(mesh::steps_of_mesh(pinholes, made_as)), "views", arguments.quiet);
    const mesh::SceneMesh made =
        mesh::mesh_of_scene(renderer, pinholes, made_as, [&](size_t steps) { progress.update(int(steps)); });
    if (!made.note.empty()) progress.note(made.note);
    make_folder(arguments.output.parent_path());
    mesh::save_mesh(arguments.output, made.fused.mesh, up.value_or(glm::dvec3(0, -1, 0)));
    print(made.fused, arguments, made.most_triangles, progress);
    return 0;
}

int run(CLI::App& app, MeshArguments& arguments) {
    SplatInput input = splat_input(arguments.splats);
    arguments.splats = input.file;
    if (!input.run) input.run = folders::run_of_splats(arguments.splats);
    if (input.run && input.run->flag("points"))
        throw InputError(core::one_line(arguments.splats.string()) +
                         " holds the spheres of --points, which have no surfaces");
    if (input.run) use_options_of(*input.run, app, arguments.cameras);
    return make_mesh(app, arguments, input.run);
}

}  // namespace

Action add_mesh(CLI::App& app) {
    const auto arguments = std::make_shared<MeshArguments>();
    options::add(app, "SPLATS", arguments->splats);
    options::add(app, "output", arguments->output);
    options::add(app, "cameras", arguments->cameras);
    options::add(app, "voxel", arguments->voxel);
    options::add(app, "triangles", arguments->triangles);
    options::add(app, "depth", arguments->depth);
    options::add(app, "unbounded", arguments->unbounded);
    options::add(app, "collision", arguments->collision);
    options::add(app, "transform", arguments->transform);
    options::add(app, "up", arguments->up);
    options::add(app, "scale-to", arguments->scale_to);
    options::add(app, "downscale", arguments->of_cameras);
    options::add(app, "max-width", arguments->of_cameras);
    add_device_options(app, arguments->device);
    options::add(app, "quiet", arguments->quiet);
    return [&app, arguments] { return run(app, *arguments); };
}

}  // namespace ewa::cli
