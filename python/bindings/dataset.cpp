// SPDX-License-Identifier: Apache-2.0
#include "inputs.h"

#include <nanobind/stl/optional.h>
#include <nanobind/stl/pair.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/tuple.h>
#include <nanobind/stl/vector.h>

#include <algorithm>
#include <array>
#include <numeric>
#include <optional>
#include <tuple>

#include "arrays.h"
#include "bindings.h"
#include "cameras.h"
#include "core/typing.h"
#include "errors.h"
#include "images.h"
#include "options.h"

namespace ewa::python {
namespace {

/// ewa.Images: decodes an image when it is asked for.
struct Images {
    LoadedDataset data;
    std::vector<size_t> frames;  // indices

    const Frame& frame(ptrdiff_t index) const {
        const auto count = ptrdiff_t(frames.size());
        if (index < -count || index >= count)
            throw nb::index_error(("there are " + std::to_string(count) + " images").c_str());
        return data.dataset->frames[frames[size_t(index < 0 ? index + count : index)]];
    }
};

Images images_of(const LoadedDataset& data) {
    Images images{data, std::vector<size_t>(data.dataset->frames.size())};
    std::iota(images.frames.begin(), images.frames.end(), size_t(0));
    return images;
}

nb::ndarray<nb::numpy, float> image(const Images& images, ptrdiff_t index) {
    const Frame& frame = images.frame(index);
    return to_numpy(with_files([&] { return load_frame_image(frame); }));
}

Images some_images(const Images& images, const nb::slice& key) {
    const auto [start, stop, step, count] = key.compute(images.frames.size());
    Images some{images.data, {}};
    for (size_t i = 0; i < count; ++i)
        some.frames.push_back(images.frames[size_t(start + ptrdiff_t(i) * step)]);
    return some;
}

// Pickles, for processes that read the same files.

using DatasetState = std::tuple<std::filesystem::path, int, int, bool, int, int>;

DatasetState pickled(const LoadedDataset& data) {
    return {data.path,
            data.options.downscale,
            int(data.options.masks),
            data.options.need_images,
            data.options.max_width,
            int(data.options.lens)};
}

LoadedDataset opened(const DatasetState& state) {
    const auto& [path, downscale, masks, need_images, max_width, lens] = state;
    return open_dataset(path, {.downscale = downscale,
                               .max_width = max_width,
                               .masks = MaskUse(masks),
                               .lens = LensUse(lens),
                               .need_images = need_images});
}

// Where a rolling shutter begins, and the pose at its end.
using ReadoutState = std::optional<std::array<double, 13>>;
using CameraState = std::tuple<int, int, std::array<double, 16>, int, std::array<double, 13>, ReadoutState>;

std::array<double, 13> stored_terms(const Distortion& d) {
    return {d.k1, d.k2, d.p1, d.p2, d.k3, d.k4, d.k5, d.k6, d.s1, d.s2, d.s3, d.s4, d.skew};
}

Distortion distortion_of(int lens, const std::array<double, 13>& k) {
    return {k[0], k[1], k[2], k[3], k[4], k[5], k[6], k[7], k[8], k[9], k[10], k[11], Lens(lens), k[12]};
}

ReadoutState pickled(const std::optional<Readout>& readout) {
    if (!readout) return std::nullopt;
    std::array<double, 13> values{double(readout->from)};
    for (int i = 0; i < 3; ++i) {
        for (int k = 0; k < 3; ++k) values[size_t(1 + 3 * i + k)] = readout->rotation[i][k];
        values[size_t(10 + i)] = readout->translation[i];
    }
    return values;
}

std::optional<Readout> readout_of(const ReadoutState& state) {
    if (!state) return std::nullopt;
    const std::array<double, 13>& v = *state;
    Readout readout{ReadoutFrom(int(v[0])), {}, {}};
    for (int i = 0; i < 3; ++i) {
        for (int k = 0; k < 3; ++k) readout.rotation[i][k] = v[size_t(1 + 3 * i + k)];
        readout.translation[i] = v[size_t(10 + i)];
    }
    return readout;
}

CameraState pickled(const Camera& c) {
    std::array<double, 16> values{c.fx, c.fy, c.cx, c.cy};
    for (int i = 0; i < 3; ++i) {
        for (int k = 0; k < 3; ++k) values[size_t(4 + 3 * i + k)] = c.rotation[i][k];
        values[size_t(13 + i)] = c.translation[i];
    }
    return {c.width,           c.height, values, int(c.distortion.lens), stored_terms(c.distortion),
            pickled(c.readout)};
}

Camera camera_of(const CameraState& state) {
    const auto& [width, height, v, lens, terms, readout] = state;
    Camera c{.width = width, .height = height, .fx = v[0], .fy = v[1], .cx = v[2], .cy = v[3]};
    c.distortion = distortion_of(lens, terms);
    c.readout = readout_of(readout);
    for (int i = 0; i < 3; ++i) {
        for (int k = 0; k < 3; ++k) c.rotation[i][k] = v[size_t(4 + 3 * i + k)];
        c.translation[i] = v[size_t(13 + i)];
    }
    return c;
}

using FrameState = std::tuple<std::string, std::filesystem::path, std::optional<std::filesystem::path>, bool,
                              bool, std::array<int, 6>, std::array<double, 13>, std::array<CameraState, 3>>;

std::optional<std::filesystem::path> mask_path_of(const Frame& frame) {
    return frame.mask_path.empty() ? std::nullopt : std::optional(frame.mask_path);
}

FrameState pickled(const Frame& f) {
    const Distortion& d = f.distortion;
    return {f.name,          f.image_path,
            mask_path_of(f), f.image_exists,
            f.eight_bit,     {f.orientation, int(f.masks), f.downscale, f.split, int(d.lens), int(f.reduced)},
            stored_terms(d), {pickled(f.camera), pickled(f.source), pickled(f.pinhole)}};
}

Frame frame_of(const FrameState& state) {
    const auto& [name, image_path, mask_path, exists, eight_bit, n, k, cameras] = state;
    return {.name = name,
            .image_path = image_path,
            .image_exists = exists,
            .orientation = n[0],
            .eight_bit = eight_bit,
            .camera = camera_of(cameras[0]),
            .source = camera_of(cameras[1]),
            .reduced = n[5] != 0,
            .mask_path = mask_path.value_or(std::filesystem::path()),
            .masks = MaskUse(n[1]),
            .depth_path = {},
            .left_out = nullptr,
            .behind = std::nullopt,
            .seen = nullptr,
            .distortion = distortion_of(n[4], k),
            .pinhole = camera_of(cameras[2]),
            .downscale = n[2],
            .split = n[3],
            .kept = {}};
}

void make_dataset(LoadedDataset* self, const std::filesystem::path& path, std::optional<int> downscale,
                  const std::optional<std::string>& masks, bool need_images, std::optional<int> max_width,
                  const std::optional<std::string>& lens) {
    AskedDataset asked{
        .downscale = downscale, .max_width = max_width, .masks = {}, .lens = {}, .need_images = need_images};
    if (downscale && *downscale < 1) throw InputError("downscale is less than 1");
    if (max_width && *max_width < 0) throw InputError("max_width is less than 0");
    if (masks) asked.masks = asked_for("masks", *masks).masks;
    if (lens) asked.lens = asked_for("lens", *lens).lens;
    new (self) LoadedDataset(open_dataset(path, asked));
}

std::vector<Camera> cameras(const LoadedDataset& data) {
    std::vector<Camera> all;
    for (const Frame& frame : data.dataset->frames) all.push_back(frame.camera);
    return all;
}

nb::ndarray<nb::numpy, double> positions(const LoadedDataset& data) {
    std::vector<double> values;
    for (const glm::dvec3& p : data.dataset->points.positions) values.insert(values.end(), {p.x, p.y, p.z});
    return to_numpy(std::move(values), {data.dataset->points.positions.size(), 3});
}

nb::ndarray<nb::numpy, uint8_t> colors(const LoadedDataset& data) {
    std::vector<uint8_t> values;
    for (const auto& c : data.dataset->points.colors) values.insert(values.end(), c.begin(), c.end());
    return to_numpy(std::move(values), {data.dataset->points.colors.size(), 3});
}

std::pair<std::vector<int>, std::vector<int>> split(const LoadedDataset& data,
                                                    std::optional<int> test_every) {
    if (test_every && *test_every < 0) throw InputError("test_every is negative");
    Split parts = split_frames(*data.dataset, test_every.value_or(data.test_every));
    return {std::move(parts.train), std::move(parts.test)};
}

/// For people.
std::string place_of(const LoadedDataset& data) {
    return (data.archived ? data.path : data.dataset->root).string();
}

std::string dataset_text(const LoadedDataset& data) {
    return "Dataset('" + place_of(data) + "', " + core::counted(data.dataset->frames.size(), "frame") + ")";
}

void bind_frame(nb::module_& module) {
    nb::class_<Frame>(module, "Frame", "An image of a dataset, and its camera.")
        .def_ro("name", &Frame::name, "In the dataset, such as \"0001.jpg\".")
        .def_ro("image_path", &Frame::image_path)
        .def_ro("image_exists", &Frame::image_exists)
        .def_prop_ro("mask_path", mask_path_of,
                     nb::for_getter(nb::sig("def mask_path(self) -> pathlib.Path | None")))
        .def_prop_ro(
            "width", [](const Frame& frame) { return frame.camera.width; }, "px")
        .def_prop_ro(
            "height", [](const Frame& frame) { return frame.camera.height; }, "px")
        .def_prop_ro(
            "camera_model", [](const Frame& frame) { return model_of(frame.camera.distortion); },
            "As render() takes it: \"pinhole\" where the image is undistorted, or the lens of its own.")
        .def_prop_ro(
            "distortion", [](const Frame& frame) { return terms_of(frame.camera.distortion); },
            nb::for_getter(nb::sig("def distortion(self) -> numpy.typing.NDArray[numpy.float64] | None")),
            "The terms of the lens, as render() takes them.")
        .def_prop_ro(
            "rolling_shutter", [](const Frame& frame) { return order_of(frame.camera); },
            "As render() takes it: \"global\", or the order in which rows or columns are read.")
        .def("__repr__",
             [](const Frame& frame) {
                 return "Frame('" + frame.name + "', " + std::to_string(frame.camera.width) + "x" +
                        std::to_string(frame.camera.height) + ")";
             })
        .def(
            "_repr_png_",
            [](const Frame& frame) -> nb::object {
                if (!frame.image_exists) return nb::none();
                return png_bytes(with_files([&] { return load_frame_image(frame); }));
            },
            nb::sig("def _repr_png_(self) -> bytes | None"), "The image, for notebooks.")
        .def(
            "__getstate__", [](const Frame& frame) { return pickled(frame); },
            nb::sig("def __getstate__(self) -> tuple[object, ...]"))
        .def(
            "__setstate__",
            [](Frame& frame, const FrameState& state) { new (&frame) Frame(frame_of(state)); },
            nb::sig("def __setstate__(self, state: tuple[object, ...], /) -> None"));
    nb::class_<Images>(module, "Images", "The images of a dataset. Each is decoded when it is asked for.")
        .def("__len__", [](const Images& images) { return images.frames.size(); })
        .def(
            "__iter__", [](nb::handle self) { return nb::steal<nb::iterator>(PySeqIter_New(self.ptr())); },
            nb::sig("def __iter__(self) -> collections.abc.Iterator[numpy.typing.NDArray[numpy.float32]]"))
        .def("__getitem__", image, nb::arg("index"),
             nb::sig("def __getitem__(self, index: int, /) -> numpy.typing.NDArray[numpy.float32]"),
             "[H, W, 3], or [H, W, 4] with a mask or alpha, from 0 to 1: as the frame's camera sees it.")
        .def("__getitem__", some_images, nb::arg("index"),
             nb::sig("def __getitem__(self, index: slice, /) -> Images"), "Images of some frames.")
        .def("__repr__",
             [](const Images& images) {
                 return "Images(" + core::counted(images.frames.size(), "image") + " of '" +
                        place_of(images.data) + "')";
             })
        .def(
            "__getstate__",
            [](const Images& images) { return std::tuple(pickled(images.data), images.frames); },
            nb::sig("def __getstate__(self) -> tuple[object, ...]"))
        .def(
            "__setstate__",
            [](Images& images, const std::tuple<DatasetState, std::vector<size_t>>& state) {
                Images read{opened(std::get<0>(state)), std::get<1>(state)};
                for (const size_t frame : read.frames)
                    if (frame >= read.data.dataset->frames.size())
                        throw InputError("the dataset has fewer images than when it was pickled");
                new (&images) Images(std::move(read));
            },
            nb::sig("def __setstate__(self, state: tuple[object, ...], /) -> None"));
}

}  // namespace

void bind_dataset(nb::module_& module) {
    bind_frame(module);
    nb::class_<LoadedDataset>(module, "Dataset",
                              "Images with cameras, and the points that they were reconstructed from.")
        .def("__init__", make_dataset, nb::arg("path"), nb::kw_only(), nb::arg("downscale") = nb::none(),
             nb::arg("masks") = nb::none(), nb::arg("need_images") = true, nb::arg("max_width") = nb::none(),
             nb::arg("lens") = nb::none(),
             nb::sig("def __init__(self, path: str | os.PathLike[str], *, downscale: int | None = None, "
                     "masks: typing.Literal['auto', 'ignore', 'cut', 'none'] | None = None, "
                     "need_images: bool = True, max_width: int | None = None, "
                     "lens: typing.Literal['auto', 'native', 'undistort'] | None = None) -> None"),
             "Reads a COLMAP model, transforms.json or cameras of another program: a folder, the file, or a "
             "zip archive. "
             "The folder of a training run stands for its dataset, read as the run did where nothing else is "
             "given, with the cameras that it refined. need_images False reads only cameras. Raises "
             "InputError.")
        .def_prop_ro("root", [](const LoadedDataset& d) { return d.dataset->root; })
        .def_prop_ro(
            "used", [](const LoadedDataset& d) { return used_text(*d.dataset); },
            "What was used of what was found, such as \"8 of 8 photos, 0 of 8 masks (...)\". A warning, too, "
            "where masks, depth maps or most photos are not used.")
        .def_prop_ro(
            "notes", [](const LoadedDataset& d) { return d.dataset->notes; },
            "What was chosen where the files leave a choice, and what they have that is not used.")
        .def_prop_ro(
            "frames", [](const LoadedDataset& d) { return d.dataset->frames; }, "In the order of names.")
        .def_prop_ro("images", images_of)
        .def_prop_ro(
            "viewmats", [](const LoadedDataset& d) { return viewmats_of(cameras(d)); }, nb::rv_policy::move,
            nb::for_getter(nb::sig("def viewmats(self) -> numpy.typing.NDArray[numpy.float64]")),
            "[n, 4, 4], from the world to the camera (x right, y down, z forward).")
        .def_prop_ro(
            "viewmats_end", [](const LoadedDataset& d) { return viewmats_of(ends_of(cameras(d))); },
            nb::rv_policy::move,
            nb::for_getter(nb::sig("def viewmats_end(self) -> numpy.typing.NDArray[numpy.float64]")),
            "[n, 4, 4], the poses when a rolling shutter reaches the last border; those of viewmats with a "
            "global one.")
        .def_prop_ro(
            "Ks", [](const LoadedDataset& d) { return intrinsics_of(cameras(d)); }, nb::rv_policy::move,
            nb::for_getter(nb::sig("def Ks(self) -> numpy.typing.NDArray[numpy.float64]")),
            "[n, 3, 3], in pixels of the frame's width and height.")
        .def_prop_ro("points", positions, nb::rv_policy::move,
                     nb::for_getter(nb::sig("def points(self) -> numpy.typing.NDArray[numpy.float64]")),
                     "[m, 3], in world units.")
        .def_prop_ro("point_colors", colors, nb::rv_policy::move,
                     nb::for_getter(nb::sig("def point_colors(self) -> numpy.typing.NDArray[numpy.uint8]")),
                     "[m, 3]")
        .def_prop_ro("missing_images", [](const LoadedDataset& d) { return d.dataset->missing_images; })
        .def("split", split, nb::arg("test_every") = nb::none(),
             "The indices of the training frames and of those held out, as ewa train chooses them: every "
             "eighth unless given, or "
             "as the run did.")
        .def("__len__", [](const LoadedDataset& d) { return d.dataset->frames.size(); })
        .def("__repr__", dataset_text)
        .def(
            "__getstate__", [](const LoadedDataset& data) { return pickled(data); },
            nb::sig("def __getstate__(self) -> tuple[object, ...]"))
        .def(
            "__setstate__",
            [](LoadedDataset& data, const DatasetState& state) { new (&data) LoadedDataset(opened(state)); },
            nb::sig("def __setstate__(self, state: tuple[object, ...], /) -> None"));
}

}  // namespace ewa::python
