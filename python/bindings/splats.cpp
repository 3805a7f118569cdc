// SPDX-License-Identifier: Apache-2.0
#include <nanobind/stl/optional.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "arrays.h"
#include "bindings.h"
#include "edits.h"
#include "errors.h"
#include "ewa/dataset.h"
#include "ewa/splat_edit.h"
#include "ewa/splat_files.h"
#include "inputs.h"
#include "io/splats/format_table.h"
#include "io/splats/output_options.h"
#include "io/splats/prepare.h"
#include "options.h"

namespace ewa::python {
namespace {

using Floats = nb::ndarray<nb::numpy, float>;

constexpr ptrdiff_t kCoefficients[] = {1, 4, 9, 16};

/// The lengths of an array of the splats.
struct Member {
    std::vector<float> Gaussians::*values;
    std::vector<size_t> (*shape)(const Gaussians&);
};

const Member kMeans{&Gaussians::means, [](const Gaussians& g) { return std::vector<size_t>{g.size(), 3}; }};
const Member kQuaternions{&Gaussians::quaternions, [](const Gaussians& g) {
                              return std::vector<size_t>{g.size(), 4};
                          }};
const Member kLogScales{&Gaussians::log_scales, [](const Gaussians& g) {
                            return std::vector<size_t>{g.size(), 3};
                        }};
const Member kOpacities{&Gaussians::opacity_logits,
                        [](const Gaussians& g) { return std::vector<size_t>{g.size()}; }};
const Member kSh{&Gaussians::sh, [](const Gaussians& g) {
                     return std::vector<size_t>{g.size(), g.sh_stride() / 3, 3};
                 }};

/// The splats' own memory, which `self` keeps. No function changes the number of splats of an object.
Floats view(nb::handle self, const Member& member) {
    Gaussians& gaussians = nb::cast<Splats&>(self).gaussians;
    const std::vector<size_t> shape = member.shape(gaussians);
    return Floats((gaussians.*member.values).data(), shape.size(), shape.data(), self);
}

void assign(Splats& splats, const Member& member, const char* name, nb::handle value) {
    Gaussians& gaussians = splats.gaussians;
    const std::vector<size_t> lengths = member.shape(gaussians);
    const Array<float> array(value, name, Shape(lengths.begin(), lengths.end()));
    // The value may be a view of these splats.
    std::copy_n(array.data(), array.size(), (gaussians.*member.values).begin());
}

void set_origin(Splats& splats, nb::handle value) {
    const Array<double> origin(value, "origin", {3});
    if (!std::all_of(origin.data(), origin.data() + 3, [](double x) { return std::isfinite(x); }))
        throw nb::value_error("origin is not finite");
    splats.gaussians.origin = {origin.data()[0], origin.data()[1], origin.data()[2]};
}

int degree_of(size_t coefficients) {
    const auto* found =
        std::find(std::begin(kCoefficients), std::end(kCoefficients), ptrdiff_t(coefficients));
    return int(found - std::begin(kCoefficients));
}

void make_splats(Splats* self, nb::handle means, nb::handle quats, nb::handle log_scales,
                 nb::handle opacity_logits, nb::handle sh, nb::handle origin) {
    const Array<float> positions(means, "means", {any('n'), 3});
    const auto n = ptrdiff_t(positions.length(0));
    const Array<float> turns(quats, "quats", {n, 4}), scales(log_scales, "log_scales", {n, 3});
    const Array<float> opacities(opacity_logits, "opacity_logits", {n});
    const Array<float> colors(sh, "sh", {Shape{n, 1, 3}, Shape{n, 4, 3}, Shape{n, 9, 3}, Shape{n, 16, 3}});
    Splats made;
    Gaussians& g = made.gaussians;
    g.sh_degree = degree_of(colors.length(1));
    g.means = positions.values();
    g.quaternions = turns.values();
    g.log_scales = scales.values();
    g.opacity_logits = opacities.values();
    g.sh = colors.values();
    set_origin(made, origin);
    new (self) Splats(std::move(made));
}

/// For pickle and copy. The arrays are views: pickle and copy copy them.
nb::tuple state_of(nb::handle self) {
    nb::list values;
    for (const char* name : {"means", "quats", "log_scales", "opacity_logits", "sh", "origin", "antialiased",
                             "comments", "density"})
        values.append(self.attr(name));
    return nb::tuple(values);
}

void restore(Splats* self, const nb::tuple& state) {
    if (state.size() != 9) throw nb::value_error("the pickled splats are of another version of ewa");
    make_splats(self, state[0], state[1], state[2], state[3], state[4], state[5]);
    self->antialiased = nb::cast<bool>(state[6]);
    self->comments = nb::cast<std::vector<std::string>>(state[7]);
    self->gaussians.density = nb::cast<bool>(state[8]);
}

Splats from_points(nb::handle positions, nb::handle colors, int sh_degree) {
    const Array<double> points(positions, "positions", {any('m'), 3});
    const Array<uint8_t> bytes(colors, "colors", {ptrdiff_t(points.length(0)), 3});
    if (sh_degree < 0 || sh_degree > kMaxShDegree) throw nb::value_error("sh_degree is not 0, 1, 2 or 3");
    PointCloud cloud;
    for (size_t i = 0; i < points.length(0); ++i) {
        const double* p = points.data() + 3 * i;
        const uint8_t* c = bytes.data() + 3 * i;
        cloud.positions.emplace_back(p[0], p[1], p[2]);
        cloud.colors.push_back({c[0], c[1], c[2]});
    }
    const nb::gil_scoped_release released;
    return {gaussians_from_points(cloud, sh_degree)};
}

/// numpy's own rules say which splats a key means.
Splats selected(const Splats& splats, nb::handle key) {
    const nb::module_ numpy = nb::module_::import_("numpy");
    const nb::object all = numpy.attr("arange")(splats.gaussians.size(), nb::arg("dtype") = "int64");
    const Array<int64_t> indices(numpy.attr("atleast_1d")(all[key]), "the key", {any('m')});
    const nb::gil_scoped_release released;
    Splats some = splats;
    select_splats(some.gaussians, {indices.data(), indices.data() + indices.size()});
    return some;
}

Splats join(const nb::args& parts) {
    if (parts.size() == 0) throw nb::type_error("join() needs splats");
    for (const nb::handle part : parts)
        if (!nb::isinstance<Splats>(part)) throw nb::type_error("join() takes Splats alone");
    Splats all = nb::cast<const Splats&>(parts[0]);
    for (size_t i = 1; i < parts.size(); ++i)
        append_splats(all.gaussians, nb::cast<const Splats&>(parts[i]).gaussians);
    return all;
}

/// Options that only some files have.
struct FileArguments {
    std::optional<int> levels;
    bool gltf_spz = false, unbundled = false;
    std::optional<std::string> title;
    nb::handle geo;
    std::optional<ObjectOrPath<LoadedDataset>> cameras;

    io::OutputOptions options() const {
        constexpr int kMostLevels = 32;
        if (levels && (*levels < 1 || *levels > kMostLevels))
            throw InputError("levels is not from 1 to " + std::to_string(kMostLevels));
        return {.levels = levels.value_or(0),
                .gltf_spz = gltf_spz,
                .unbundled = unbundled,
                .geo = geo.is_none() ? "" : list_text(geo),
                .title = title.value_or("")};
    }
};

std::vector<std::string> save(const std::filesystem::path& path, const Splats& splats,
                              const std::vector<std::string>& comments, std::optional<bool> antialiased,
                              int spz_version, const FileArguments& arguments) {
    if (spz_version != 3 && spz_version != 4) throw nb::value_error("spz_version is neither 3 nor 4");
    SaveOptions save{comments, antialiased.value_or(splats.antialiased), spz_version};
    io::set_output_options(save, path, arguments.options());
    const io::FormatRow& row = io::row_to_write(path);
    if (arguments.cameras && row.format != SplatFormat::page)
        throw InputError("cameras: only a page has views");
    Dataset cameras;
    if (arguments.cameras)
        cameras = *Opened<LoadedDataset>(*arguments.cameras, [](const std::filesystem::path& named) {
                       return open_dataset(named, {.need_images = false});
                   })->dataset;
    save.page.cameras = &cameras;
    std::vector<std::string> remarks = with_new_file(path, [&] {
        if (row.write) return save_splats(path, splats.gaussians, save);
        Gaussians written = splats.gaussians;
        std::vector<std::string> lost = io::match_file(written, row);  // as ewa convert
        for (std::string& line : save_splats(path, std::move(written), save)) lost.push_back(std::move(line));
        return lost;
    });
    for (std::string& remark : remarks) remark = spelled(remark.c_str());
    return remarks;
}

std::string splats_text(const Splats& splats) {
    const size_t n = splats.gaussians.size();
    return "Splats(" + std::to_string(n) + (n == 1 ? " splat" : " splats") + ", SH degree " +
           std::to_string(splats.gaussians.sh_degree) + ")";
}

template <class Class>
void bind_member(Class& splats, const char* name, const Member& member, const char* help) {
    splats.def_prop_rw(
        name, [&member](nb::handle self) { return view(self, member); },
        [&member, name](Splats& self, nb::handle value) { assign(self, member, name, value); },
        nb::for_getter(
            nb::sig((std::string("def ") + name + "(self) -> numpy.typing.NDArray[numpy.float32]").c_str())),
        nb::for_setter(nb::sig(
            (std::string("def ") + name + "(self, value: numpy.typing.ArrayLike, /) -> None").c_str())),
        help);
}

void bind_class(nb::module_& module) {
    nb::class_<Splats> splats(
        module, "Splats",
        "A scene of Gaussian splats, with the values of an INRIA PLY. Its arrays are views that can be "
        "written to, and stay valid. Indexing takes what numpy takes, and copies.");
    splats.def("__init__", make_splats, nb::kw_only(), nb::arg("means"), nb::arg("quats"),
               nb::arg("log_scales"), nb::arg("opacity_logits"), nb::arg("sh"),
               nb::arg("origin") = nb::make_tuple(0, 0, 0),
               nb::sig("def __init__(self, *, means: numpy.typing.ArrayLike, quats: numpy.typing.ArrayLike, "
                       "log_scales: numpy.typing.ArrayLike, opacity_logits: numpy.typing.ArrayLike, "
                       "sh: numpy.typing.ArrayLike, origin: numpy.typing.ArrayLike = (0, 0, 0)) -> None"),
               "Copies arrays of the shapes [n, 3], [n, 4], [n, 3], [n], [n, K, 3] with K = 1, 4, 9 or 16, "
               "and [3].");
    splats.def_static(
        "from_points", from_points, nb::arg("positions"), nb::arg("colors"), nb::arg("sh_degree") = 3,
        nb::sig("def from_points(positions: numpy.typing.ArrayLike, colors: numpy.typing.ArrayLike, "
                "sh_degree: int = 3) -> Splats"),
        "One splat for each point, as training begins: positions [m, 3] and colours [m, 3] of 0 to 255.");
    bind_member(splats, "means", kMeans, "[n, 3], in world units, relative to origin.");
    bind_member(splats, "quats", kQuaternions, "[n, 4], in the order w x y z, of any length above 0.");
    bind_member(splats, "log_scales", kLogScales,
                "[n, 3], the natural logarithm of the standard deviations in world units.");
    bind_member(splats, "opacity_logits", kOpacities, "[n]; the sigmoid of these is the opacity.");
    bind_member(splats, "sh", kSh,
                "[n, K, 3], the spherical harmonics of the colours, K = (sh_degree + 1) squared.");
    splats.def_prop_rw(
        "origin",
        [](nb::handle self) {
            const size_t three = 3;
            return nb::ndarray<nb::numpy, double>(&nb::cast<Splats&>(self).gaussians.origin[0], 1, &three,
                                                  self);
        },
        set_origin, nb::for_getter(nb::sig("def origin(self) -> numpy.typing.NDArray[numpy.float64]")),
        nb::for_setter(nb::sig("def origin(self, value: numpy.typing.ArrayLike, /) -> None")),
        "[3], in world units: zero unless the scene is far from the world's origin.");
    splats.def_prop_ro(
        "sh_degree", [](const Splats& s) { return s.gaussians.sh_degree; }, "0 to 3.");
    splats.def_rw("antialiased", &Splats::antialiased,
                  "Whether the splats were trained for antialiased renders (Mip-Splatting).");
    splats.def_prop_rw(
        "density", [](const Splats& s) { return s.gaussians.density; },
        [](Splats& s, bool density) { s.gaussians.density = density; },
        "Whether opacity_logits are those of the density kernel. Files keep it as .ply alone.");
    splats.def_ro("comments", &Splats::comments, "The comments of the file.");
    bind_edits(splats);
    splats.def("__len__", [](const Splats& s) { return s.gaussians.size(); });
    splats.def("__getitem__", selected, nb::arg("key"),
               nb::sig("def __getitem__(self, key: object, /) -> Splats"));
    splats.def("__repr__", splats_text);
    splats.def("__getstate__", state_of, nb::sig("def __getstate__(self) -> tuple[object, ...]"));
    splats.def("__setstate__", restore,
               nb::sig("def __setstate__(self, state: tuple[object, ...], /) -> None"));
}

}  // namespace

void bind_splats(nb::module_& module) {
    bind_class(module);
    module.def("load", open_splats, nb::arg("path"),
               "Reads splats of any format that ewa reads, or those of a training run by its folder. "
               "Contents of the file that are skipped are "
               "warnings. Raises "
               "InputError that names the file and the place.");
    module.def(
        "save",
        [](const std::filesystem::path& path, const Splats& splats, const std::vector<std::string>& comments,
           std::optional<bool> antialiased, int spz_version, bool gltf_spz, std::optional<int> levels,
           std::optional<std::string> title, bool unbundled, nb::handle geo,
           std::optional<ObjectOrPath<LoadedDataset>> cameras) {
            return save(path, splats, comments, antialiased, spz_version,
                        {levels, gltf_spz, unbundled, std::move(title), geo, std::move(cameras)});
        },
        nb::arg("path"), nb::arg("splats"), nb::kw_only(), nb::arg("comments") = std::vector<std::string>(),
        nb::arg("antialiased") = nb::none(), nb::arg("spz_version") = 3, nb::arg("gltf_spz") = false,
        nb::arg("levels") = nb::none(), nb::arg("title") = nb::none(), nb::arg("unbundled") = false,
        nb::arg("geo") = nb::none(), nb::arg("cameras") = nb::none(),
        nb::sig(
            "def save(path: str | os.PathLike[str], splats: Splats, *, comments: "
            "collections.abc.Sequence[str] = (), antialiased: bool | None = None, spz_version: int = 3, "
            "gltf_spz: bool = False, levels: int | None = None, title: str | None = None, unbundled: bool "
            "= False, geo: str | collections.abc.Sequence[float] | None = None, cameras: " EWA_DATASET_TYPE
            " | None = None) -> list[str]"),
        "Writes splats in the format of the extension, a page that shows them (.html), or 3D Tiles "
        "(tileset.json). The options of ewa convert: levels of a lod-meta.json, tileset.json or "
        "unbundled "
        "page; title and unbundled of a page; geo of a tileset.json. cameras: a dataset whose cameras become "
        "the views of a page. A file is replaced as a whole, and missing folders "
        "are "
        "made. Returns one line for "
        "each thing that "
        "the format does not hold. Raises InputError for an unknown extension, OSError if the disk refuses.");
    module.def("join", join, nb::sig("def join(*splats: Splats) -> Splats"),
               "All splats in one scene, in this order. The SH degree becomes the largest.");
}

}  // namespace ewa::python
