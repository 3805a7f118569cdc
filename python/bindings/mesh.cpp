// SPDX-License-Identifier: Apache-2.0
#include <nanobind/stl/filesystem.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/variant.h>

#include <algorithm>
#include <glm/vec3.hpp>
#include <optional>

#include "arrays.h"
#include "bindings.h"
#include "capture/run_inputs.h"
#include "core/text.h"
#include "core/typing.h"
#include "core/words.h"
#include "device.h"
#include "edits.h"
#include "errors.h"
#include "ewa/error.h"
#include "ewa/renderer.h"
#include "inputs.h"
#include "mesh/mesh_files.h"
#include "mesh/scene_mesh.h"
#include "options.h"
#include "run/loss_option.h"

namespace ewa::python {
namespace {

namespace fs = std::filesystem;

/// ewa.Mesh
struct Mesh {
    scene::TriangleMesh mesh;
    double voxel = 0;
};

const core::Words<glm::dvec3> kAxes{{"x", {1, 0, 0}},   {"y", {0, 1, 0}},   {"z", {0, 0, 1}},
                                    {"-x", {-1, 0, 0}}, {"-y", {0, -1, 0}}, {"-z", {0, 0, -1}}};

void save_mesh(const Mesh& mesh, const fs::path& path, const std::string& up) {
    const glm::dvec3 axis = of_argument("up", [&] { return core::value_of(kAxes, up); });
    mesh::check_mesh_name(path);
    with_new_file(path, [&] { mesh::save_mesh(path, mesh.mesh, axis); });
}

nb::ndarray<nb::numpy, double> mesh_positions(const Mesh& mesh) {
    std::vector<double> values;
    for (const glm::vec3& p : mesh.mesh.positions) {
        const glm::dvec3 world = mesh.mesh.origin + glm::dvec3(p);
        values.insert(values.end(), {world.x, world.y, world.z});
    }
    return to_numpy(std::move(values), {mesh.mesh.positions.size(), 3});
}

nb::ndarray<nb::numpy, float> mesh_normals(const Mesh& mesh) {
    std::vector<float> values;
    for (const glm::vec3& n : mesh.mesh.normals) values.insert(values.end(), {n.x, n.y, n.z});
    return to_numpy(std::move(values), {mesh.mesh.normals.size(), 3});
}

template <class T, class Rows>
nb::ndarray<nb::numpy, T> threes(const Rows& rows) {
    std::vector<T> values;
    for (const auto& row : rows) values.insert(values.end(), row.begin(), row.end());
    return to_numpy(std::move(values), {rows.size(), 3});
}

/// The run of splats that a path names.
std::optional<folders::Run> run_of(const ObjectOrPath<Splats>& splats) {
    const auto* const path = std::get_if<fs::path>(&splats);
    if (!path) return std::nullopt;
    std::optional<folders::Run> run = capture::run_named(*path);
    return run ? run : folders::run_of_splats(*path);
}

using Cameras = std::optional<ObjectOrPath<LoadedDataset>>;

/// Those that are given, or the cameras of the run; empty: neither. Frames without an image are skipped, as in training.
std::optional<Dataset> cameras_of(const Cameras& cameras, const std::optional<folders::Run>& run) {
    if (!cameras && !run) return std::nullopt;
    const Opened<LoadedDataset> opened(
        cameras ? *cameras : ObjectOrPath<LoadedDataset>(run->folder),
        [](const fs::path& path) { return open_dataset(path, {.need_images = false}); });
    Dataset dataset = *opened->dataset;
    const auto missing = [](const Frame& frame) { return !frame.image_exists; };
    if (!std::ranges::all_of(dataset.frames, missing)) std::erase_if(dataset.frames, missing);
    return dataset;
}

mesh::SceneMeshOptions options_of(std::optional<double> voxel, std::optional<int> triangles, bool mean,
                                  bool unbounded, bool collision, nb::handle transform) {
    constexpr double kLeast = 1e-12, kMost = 1e12;
    if (voxel && !(*voxel >= kLeast && *voxel <= kMost)) throw InputError("voxel is not from 1e-12 to 1e12");
    if (triangles && *triangles < 4) throw InputError("triangles is less than 4");
    mesh::SceneMeshOptions options{.voxel = voxel.value_or(0),
                                   .triangles = size_t(triangles.value_or(0)),
                                   .mean_depth = mean,
                                   .unbounded = unbounded,
                                   .collision = collision};
    if (transform.is_none()) return options;
    const bool list = nb::isinstance<nb::list>(transform) || nb::isinstance<nb::tuple>(transform);
    const bool words = list && nb::len(transform) > 0 && nb::isinstance<nb::str>(transform[0]);
    options.placement = matrix_of_steps(words ? nb::borrow(transform) : nb::make_tuple(transform));
    return options;
}

Mesh make_mesh(const ObjectOrPath<Splats>& given, const std::optional<fs::path>& output,
               const Cameras& cameras, std::optional<double> voxel, std::optional<int> triangles,
               const std::string& depth, bool unbounded, bool collision, nb::handle transform,
               const std::string& up) {
    static const core::Words<int> kDepths{{"auto", 0}, {"median", 1}, {"mean", 2}};
    const int which = of_argument("depth", [&] { return core::value_of(kDepths, depth); });
    const std::optional<folders::Run> run = run_of(given);
    if (run && run->flag("points"))
        throw InputError("the run " + core::one_line(run->folder.string()) +
                         " has spheres, which have no surfaces");
    const std::string loss = run ? run->text("loss") : "";
    const bool mean = which == 2 || (which == 0 && !loss.empty() && train::parse_loss(loss).depth > 0);
    const mesh::SceneMeshOptions options =
        options_of(voxel, triangles, mean, unbounded, collision, transform);
    if (output) mesh::check_mesh_name(*output);
    of_argument("up", [&] { return core::value_of(kAxes, up); });

    const Opened<Splats> splats(given, open_splats);
    const std::optional<Dataset> dataset = cameras_of(cameras, run);
    const RenderOptions look = look_of({}, *splats);
    mesh::SceneMesh made;
    {
        const DeviceWork work;
        const mesh::Pinholes pinholes =
            dataset ? mesh::Pinholes(*dataset, !run || cameras) : mesh::cameras_around(splats->gaussians);
        Renderer renderer(work.device(), splats->gaussians, look);
        made = mesh::mesh_of_scene(renderer, pinholes, options, [](size_t) { check_signals(); });
    }
    if (!made.note.empty()) warn(PyExc_UserWarning, spelled(made.note.c_str()));
    Mesh mesh{std::move(made.fused.mesh), made.fused.voxel};
    if (output) save_mesh(mesh, *output, up);
    return mesh;
}

std::string mesh_text(const Mesh& mesh) {
    return "Mesh(" + std::to_string(mesh.mesh.positions.size()) + " vertices, " +
           core::counted(mesh.mesh.triangles.size(), "triangle") + ")";
}

#define EWA_UP_TYPE "typing.Literal['x', 'y', 'z', '-x', '-y', '-z'] = '-y'"

}  // namespace

void bind_mesh(nb::module_& module) {
    using namespace nb::literals;
    nb::class_<Mesh>(module, "Mesh", "Triangles, of the surfaces in a scene.")
        .def_prop_ro("positions", mesh_positions, nb::rv_policy::move,
                     nb::for_getter(nb::sig("def positions(self) -> numpy.typing.NDArray[numpy.float64]")),
                     "[n, 3], of the vertices, in world units.")
        .def_prop_ro(
            "triangles", [](const Mesh& m) { return threes<uint32_t>(m.mesh.triangles); },
            nb::rv_policy::move,
            nb::for_getter(nb::sig("def triangles(self) -> numpy.typing.NDArray[numpy.uint32]")),
            "[m, 3], indices of vertices, counter-clockwise as seen from the front.")
        .def_prop_ro("normals", mesh_normals, nb::rv_policy::move,
                     nb::for_getter(nb::sig("def normals(self) -> numpy.typing.NDArray[numpy.float32]")),
                     "[n, 3], of length 1.")
        .def_prop_ro(
            "colors", [](const Mesh& m) { return threes<uint8_t>(m.mesh.colors); }, nb::rv_policy::move,
            nb::for_getter(nb::sig("def colors(self) -> numpy.typing.NDArray[numpy.uint8]")),
            "[n, 3], sRGB; empty for a mesh of collision=True.")
        .def_ro("voxel", &Mesh::voxel, "The distance of neighbouring vertices, in world units.")
        .def("save", save_mesh, "path"_a, nb::kw_only(), "up"_a = "-y",
             nb::sig("def save(self, path: str | os.PathLike[str], *, up: " EWA_UP_TYPE ") -> None"),
             "Writes a .ply, .obj or .glb. up: the axis of the scene that becomes y in an .obj or .glb. "
             "Raises InputError, or OSError if the disk refuses.")
        .def("__repr__", mesh_text);
    module.def(
        "mesh", make_mesh, "splats"_a, "output"_a = nb::none(), nb::kw_only(), "cameras"_a = nb::none(),
        "voxel"_a = nb::none(), "triangles"_a = nb::none(), "depth"_a = "auto", "unbounded"_a = false,
        "collision"_a = false, "transform"_a = nb::none(), "up"_a = "-y",
        nb::sig("def mesh(splats: " EWA_SPLATS_TYPE
                ", output: str | os.PathLike[str] | None = None, *, cameras: " EWA_DATASET_TYPE
                " | None = None, voxel: float | None = None, triangles: int | None = None, depth: "
                "typing.Literal['auto', 'median', 'mean'] = 'auto', unbounded: bool = False, collision: bool "
                "= False, transform: str | collections.abc.Sequence[str] | numpy.typing.ArrayLike | None = "
                "None, up: " EWA_UP_TYPE ") -> Mesh"),
        "The surfaces of a scene, which is also saved to output (.ply, .obj, .glb) if that is given. "
        "cameras: a dataset whose cameras see the surfaces; those of the run unless given, and without a run "
        "cameras all around. The others are options of ewa mesh (docs/surfaces.md). Ctrl-C ends it. Raises "
        "InputError, or DeviceError where the module that makes meshes is missing.");
}

}  // namespace ewa::python
