// SPDX-License-Identifier: Apache-2.0
#include <nanobind/stl/filesystem.h>
#include <nanobind/stl/string.h>

#include "arrays.h"
#include "bindings.h"
#include "errors.h"
#include "ewa/image.h"
#include "image/image_files.h"
#include "images.h"

namespace ewa::python {
namespace {

nb::ndarray<nb::numpy, float> read_image(const std::filesystem::path& path) {
    return to_numpy(with_files([&] { return load_image(path); }));
}

/// Integers are from 0 to 255, where other numbers are from 0 to 1.
void scale_integers(Image& image, nb::handle pixels) {
    const auto dtype = nb::module_::import_("numpy").attr("asarray")(pixels).attr("dtype");
    if (nb::cast<std::string>(dtype.attr("kind")) == "f") return;
    for (float& value : image.pixels) value /= 255;
}

void write_image(const std::filesystem::path& path, nb::handle pixels) {
    const Image image = image_of(pixels, "image");
    with_new_file(path, [&] { save_image(path, image); });
}

}  // namespace

Image image_of(nb::handle value, const std::string& name) {
    std::filesystem::path file;
    if (nb::hasattr(value, "__fspath__") || nb::isinstance<nb::str>(value)) {
        file = nb::cast<std::filesystem::path>(value);
        return with_files([&] { return load_image(file); });
    }
    const Shape rgb{any('H'), any('W'), 3}, rgba{any('H'), any('W'), 4};
    const Array<float> array(value, name, {rgb, rgba});
    Image image(int(array.length(1)), int(array.length(0)), int(array.length(2)));
    image.pixels = array.values();
    scale_integers(image, value);
    return image;
}

Image weights_of(nb::handle value) {
    const Array<float> array(value, "weights", {Shape{any('H'), any('W')}, Shape{any('H'), any('W'), 1}});
    Image image(int(array.length(1)), int(array.length(0)), 1);
    image.pixels = array.values();
    return image;
}

nb::bytes png_bytes(const Image& image) {
    const std::vector<unsigned char> file = image::encode_png(image);
    return nb::bytes(file.data(), file.size());
}

void bind_images(nb::module_& module) {
    module.def("load_image", read_image, nb::arg("path"),
               nb::sig("def load_image(path: str | os.PathLike[str]) -> numpy.typing.NDArray[numpy.float32]"),
               "Reads a PNG or JPEG: [H, W, 3] or [H, W, 4], from 0 to 1. Raises InputError.");
    module.def("save_image", write_image, nb::arg("path"), nb::arg("image"),
               nb::sig("def save_image(path: str | os.PathLike[str], image: numpy.typing.ArrayLike) -> None"),
               "Writes a PNG of 8 bits from [H, W, 3] or [H, W, 4], from 0 to 1; integers are from 0 to 255. "
               "A file is replaced as a "
               "whole. Raises InputError, or OSError if the disk refuses.");
}

}  // namespace ewa::python
