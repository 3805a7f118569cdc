// SPDX-License-Identifier: Apache-2.0
#include "edits.h"

#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <algorithm>

#include "arrays.h"
#include "edit/edits.h"
#include "edit/steps.h"
#include "inputs.h"
#include "options.h"

namespace ewa::python {
namespace {

/// A copy that is edited. The arrays of the splats themselves stay valid.
Splats edited(const Splats& splats, const std::vector<edit::Edit>& edits, const edit::Cameras& cameras = {}) {
    const nb::gil_scoped_release released;
    Splats copy = splats;
    edit::apply(copy.gaussians, edits, cameras);
    return copy;
}

/// A row of the table as a method.
template <size_t letters>
struct RowName {
    char text[letters];
    consteval RowName(const char (&name)[letters]) { std::copy_n(name, letters, text); }
};
template <RowName name>
Splats without_value(const Splats& splats) {
    return edited(splats, {edit::parse(name.text)});
}
template <RowName name>
Splats with_list(const Splats& splats, nb::handle list) {
    const std::string text = list_text(list);
    if (text.empty()) throw InputError(std::string("--") + name.text + ": the list is empty");
    return edited(splats, {edit::parse(name.text, text)});
}

Splats transform(const Splats& splats, const nb::args& steps) {
    const glm::dmat4 matrix = matrix_of_steps(steps);
    return edited(splats, {{.text = "--transform",
                            .place = [matrix](const glm::dmat4& before, auto&) { return matrix * before; }}});
}

/// A number, or a text as people type it.
Splats with_number(const Splats& splats, const char* name, nb::handle number) {
    const std::string text = nb::isinstance<nb::str>(number) ? nb::cast<std::string>(number)
                                                             : std::to_string(nb::cast<int64_t>(number));
    if (text.empty()) throw InputError(std::string(name) + ": the text is empty");
    return edited(splats, {edit::parse(name, text)});
}

Splats where(const Splats& splats, const nb::args& filters, nb::handle given) {
    std::vector<edit::Edit> edits;
    for (const std::string& filter : nb::cast<std::vector<std::string>>(filters))
        edits.push_back(edit::parse("where", filter));
    if (given.is_none()) return edited(splats, edits);
    const Opened<LoadedDataset> dataset(
        nb::cast<ObjectOrPath<LoadedDataset>>(given),
        [](const std::filesystem::path& path) { return open_dataset(path, {.need_images = false}); });
    std::vector<Camera> cameras;
    for (const Frame& frame : dataset->dataset->frames) cameras.push_back(frame.camera);
    return edited(splats, edits, [&] { return cameras; });
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
    return edit::parse_transform(words);
}

void bind_edits(nb::class_<Splats>& splats) {
    using namespace nb::literals;
    splats
        .def("transform", transform, "steps"_a,
             nb::sig("def transform(self, *steps: str | numpy.typing.ArrayLike) -> Splats"),
             "The splats moved by steps, in this order: \"move=x,y,z\", \"turn=x,y,z,degrees\" about that "
             "axis, \"scale=s\", or a matrix [3, 4] or [4, 4].")
        .def(
            "scale_to", with_list<"scale-to">, "points_and_length"_a,
            nb::sig("def scale_to(self, points_and_length: collections.abc.Sequence[float] | str) -> Splats"),
            "The splats scaled until two points, x, y, z, X, Y, Z, are a length apart, which is the seventh "
            "number.")
        .def("crop", with_list<"crop">, "box"_a,
             nb::sig("def crop(self, box: collections.abc.Sequence[float] | str) -> Splats"),
             "The splats whose centre is in a box: x, y, z of its low corner, then of its high one.")
        .def("where", where, "filters"_a, nb::kw_only(), "dataset"_a = nb::none(),
             nb::sig("def where(self, *filters: str, dataset: " EWA_DATASET_TYPE " | None = None) -> Splats"),
             "The splats that pass all filters: \"opacity=0.1..\", \"z=-1..2\", \"box=x,y,z,X,Y,Z\" or "
             "\"sphere=x,y,z,radius\". Columns: x, y, z, opacity, scale (the largest), thickness (the "
             "smallest "
             "scale), red, green, blue, and with a dataset views: the images in which the centre is.")
        .def(
            "max_sh", [](const Splats& s, int degree) { return with_number(s, "max-sh", nb::int_(degree)); },
            "degree"_a, "The splats with spherical harmonics of at most this degree.")
        .def("remove_invalid", without_value<"remove-invalid">,
             "Without splats that have a value that is not finite, or a zero quaternion.")
        .def("remove_floaters", without_value<"remove-floaters">,
             "Without groups of fewer than 10 splats that touch no others of about their size.")
        .def("largest_cluster", without_value<"largest-cluster">,
             "The largest group of splats that touch others of about their size.")
        .def(
            "decimate", [](const Splats& s, nb::handle count) { return with_number(s, "decimate", count); },
            "count"_a, nb::sig("def decimate(self, count: int | str) -> Splats"),
            "Near splats merged until this number of them is left, or this part, such as \"50%\".")
        .def(
            "sort",
            [](const Splats& s, const std::string& order) { return edited(s, {edit::parse("sort", order)}); },
            "order"_a = "morton",
            "The splats in another order: \"morton\" puts neighbours in space next to each other.");
}

}  // namespace ewa::python
