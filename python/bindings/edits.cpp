// SPDX-License-Identifier: Apache-2.0
#include "edits.h"

#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include "arrays.h"
#include "inputs.h"
#include "options.h"
#include "scene/cleaning.h"
#include "scene/edits.h"

namespace ewa::python {
namespace {

/// A copy that `edit` changes. The arrays of the splats themselves stay valid.
template <class Edit>
Splats edited(const Splats& splats, const Edit& edit) {
    const nb::gil_scoped_release released;
    Splats copy = splats;
    edit(copy.gaussians);
    return copy;
}

Splats with(const Splats& splats, const scene::Edits& edits) {
    return edited(splats, [&](Gaussians& g) { scene::apply_edits(g, edits); });
}

Splats cleaned(const Splats& splats, const scene::Cleaning& cleaning,
               const std::vector<Camera>& cameras = {}) {
    return edited(splats, [&](Gaussians& g) { scene::clean(g, cleaning, cameras); });
}

Splats transform(const Splats& splats, const nb::args& steps) {
    return with(splats, {.transform = matrix_of_steps(steps)});
}

Splats decimate(const Splats& splats, nb::handle count) {
    const std::string text = nb::isinstance<nb::str>(count) ? nb::cast<std::string>(count)
                                                            : std::to_string(nb::cast<int64_t>(count));
    if (text.empty()) throw InputError("decimate: the text is empty");
    return with(splats, {.decimation = scene::parse_decimation(text)});
}

Splats crop(const Splats& splats, nb::handle box) {
    const std::string text = list_text(box);
    if (text.empty()) throw InputError("crop: the box is empty");
    return cleaned(splats, {.box = text});
}

Splats min_opacity(const Splats& splats, double least) {
    if (!(least >= 0 && least <= 1)) throw InputError("min_opacity: the opacity is not from 0 to 1");
    return cleaned(splats, {.min_opacity = least});
}

Splats max_sh(const Splats& splats, int degree) {
    if (degree < 0 || degree > kMaxShDegree) throw InputError("max_sh: the degree is not 0, 1, 2 or 3");
    return with(splats, {.max_sh = degree});
}

Splats keep(const Splats& splats, const nb::args& ranges) {
    return cleaned(splats, {.ranges = nb::cast<std::vector<std::string>>(ranges)});
}

Splats min_views(const Splats& splats, const ObjectOrPath<LoadedDataset>& given, int least) {
    const Opened<LoadedDataset> dataset(
        given, [](const std::filesystem::path& path) { return open_dataset(path, {.need_images = false}); });
    std::vector<Camera> cameras;
    for (const Frame& frame : dataset->dataset->frames) cameras.push_back(frame.camera);
    return cleaned(splats, {.min_views = least}, cameras);
}

}  // namespace

glm::dmat4 matrix_of_steps(nb::handle steps) {
    const auto word_of = [](nb::handle step) {
        if (nb::isinstance<nb::str>(step)) return nb::cast<std::string>(step);
        const Array<double> matrix(step, "a step", {Shape{3, 4}, Shape{4, 4}});
        return list_text(matrix.numpy().attr("ravel")());
    };
    std::vector<std::string> words;
    for (const nb::handle step : steps) words.push_back(word_of(step));
    return scene::parse_transform(words);
}

void bind_edits(nb::class_<Splats>& splats) {
    using namespace nb::literals;
    splats
        .def("transform", transform, "steps"_a,
             nb::sig("def transform(self, *steps: str | numpy.typing.ArrayLike) -> Splats"),
             "The splats moved by steps, in this order: \"move=x,y,z\", \"turn=x,y,z,degrees\" about that "
             "axis, \"scale=s\", or a matrix [3, 4] or [4, 4].")
        .def("crop", crop, "box"_a,
             nb::sig("def crop(self, box: collections.abc.Sequence[float] | str) -> Splats"),
             "The splats whose centre is in a box: x, y, z of its low corner, then of its high one.")
        .def(
            "crop_sphere",
            [](const Splats& s, nb::handle sphere) { return cleaned(s, {.sphere = list_text(sphere)}); },
            "sphere"_a,
            nb::sig("def crop_sphere(self, sphere: collections.abc.Sequence[float] | str) -> Splats"),
            "The splats whose centre is in a sphere: x, y, z, radius.")
        .def("keep", keep, "ranges"_a, nb::sig("def keep(self, *ranges: str) -> Splats"),
             "The splats whose columns are in all of these ranges, such as \"opacity=0.1..\" or "
             "\"z=-1..2\". Columns: x, y, z, opacity, scale (the largest), thickness (the smallest scale), "
             "red, green, blue.")
        .def("min_opacity", min_opacity, "least"_a, "The splats with at least this opacity.")
        .def("max_sh", max_sh, "degree"_a, "The splats with spherical harmonics of at most this degree.")
        .def(
            "remove_invalid", [](const Splats& s) { return cleaned(s, {.invalid = true}); },
            "Without splats that have a value that is not finite, or a zero quaternion.")
        .def(
            "remove_floaters", [](const Splats& s) { return cleaned(s, {.floaters = true}); },
            "Without groups of fewer than 10 splats that touch no others of about their size.")
        .def(
            "largest_cluster", [](const Splats& s) { return cleaned(s, {.largest_cluster = true}); },
            "The largest group of splats that touch others of about their size.")
        .def("min_views", min_views, "dataset"_a, "least"_a,
             nb::sig("def min_views(self, dataset: " EWA_DATASET_TYPE ", least: int) -> Splats"),
             "The splats whose centre is in at least so many images of the dataset.")
        .def("decimate", decimate, "count"_a, nb::sig("def decimate(self, count: int | str) -> Splats"),
             "Near splats merged until this number of them is left, or this part, such as \"50%\".");
}

}  // namespace ewa::python
