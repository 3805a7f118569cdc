// SPDX-License-Identifier: Apache-2.0
// ewa._native.operators: libewa's operators on arrays. ewa.gsplat stands on them.
#include "ewa/operators.h"

#include <nanobind/stl/optional.h>
#include <nanobind/stl/string.h>

#include <optional>

#include "arrays.h"
#include "bindings.h"
#include "device.h"
#include "ewa/error.h"

namespace ewa::python {
namespace {

/// The operators of the default device. Never destroyed: the driver may be gone before them.
Operators& operators(const DeviceWork& work) {
    struct Kept {
        std::shared_ptr<gpu::Device> device;
        std::shared_ptr<Operators> operators;
    };
    static auto* const kept = new Kept;
    const auto device = work.device();
    if (kept->device != device) *kept = {device, std::make_shared<Operators>(device)};
    return *kept->operators;
}

template <class T>
std::span<const T> span_of(const Array<T>& array) {
    return {array.data(), array.size()};
}
template <class T>
std::span<const T> span_of(const std::optional<Array<T>>& array) {
    return array ? span_of(*array) : std::span<const T>();
}

/// An argument that may be None.
template <class T>
std::optional<Array<T>> optional_array(nb::handle value, const char* name, const Shape& shape) {
    if (value.is_none()) return std::nullopt;
    return std::optional<Array<T>>(std::in_place, value, name, shape);
}

template <class T>
nb::object array_or_none(std::vector<T>&& values, const std::vector<size_t>& shape, bool there = true) {
    return there ? nb::cast(to_numpy(std::move(values), shape)) : nb::none();
}

uint32_t pixels(int value, const char* name) {
    if (value <= 0) throw InputError(std::string(name) + " is " + std::to_string(value) + ", not above zero");
    return uint32_t(value);
}

/// What blend_backward needs of an image.
struct BlendHandle {
    struct Kept {
        std::shared_ptr<BlendRecord> record;
    };
    OnDevice<Kept> kept;
    size_t splats, channels, width, height;
};

/// The arguments that both ways to blend have.
struct BlendArguments {
    Array<float> means2d, conics, opacities, features;
    std::optional<Array<float>> background;
    std::optional<Array<uint8_t>> tile_mask;
    BlendOptions options;
    bool whiteners;

    BlendArguments(nb::handle means, nb::handle shapes, nb::handle o, nb::handle f, int width, int height,
                   nb::handle background_array, nb::handle mask, int tile_size, bool keep, bool are_whiteners)
        : means2d(means, "means2d", {any('M'), 2}),
          conics(shapes, "conics", {ptrdiff_t(means2d.length(0)), 3}),
          opacities(o, "opacities", Shape{ptrdiff_t(means2d.length(0))}),
          features(f, "features", {ptrdiff_t(means2d.length(0)), any('D')}),
          background(optional_array<float>(background_array, "background", {ptrdiff_t(features.length(1))})),
          tile_mask(optional_array<uint8_t>(mask, "tile_mask", {any('H'), any('W')})),
          whiteners(are_whiteners) {
        options.width = pixels(width, "width");
        options.height = pixels(height, "height");
        options.background = span_of(background);
        options.tile_mask = span_of(tile_mask);
        options.mask_tile_size = pixels(tile_size, "tile_size");
        options.gradients = keep;
    }

    size_t size() const { return means2d.length(0); }
    ScreenSplats splats() const {
        return {.means2d = span_of(means2d),
                .conics = span_of(conics),
                .whiteners = whiteners,
                .opacities = span_of(opacities),
                .features = span_of(features),
                .channels = uint32_t(features.length(1))};
    }
    nb::tuple result(BlendedImage&& image) const {
        const size_t h = options.height, w = options.width, d = features.length(1);
        nb::object handle = nb::none();
        if (image.record)
            handle = nb::cast(BlendHandle{
                OnDevice(std::make_unique<BlendHandle::Kept>(BlendHandle::Kept{std::move(image.record)})),
                size(), d, w, h});
        return nb::make_tuple(to_numpy(std::move(image.features), {h, w, d}),
                              to_numpy(std::move(image.alphas), {h, w}), handle);
    }
};

nb::tuple blend(nb::handle means2d, nb::handle conics, nb::handle depths, nb::handle opacities,
                nb::handle features, nb::handle radii, int width, int height, nb::handle background,
                nb::handle tile_mask, int tile_size, bool keep, bool whiteners) {
    const BlendArguments arguments(means2d, conics, opacities, features, width, height, background, tile_mask,
                                   tile_size, keep, whiteners);
    const auto m = ptrdiff_t(arguments.size());
    const Array<float> order(depths, "depths", Shape{m});
    const auto sizes = optional_array<int32_t>(radii, "radii", {m, 2});
    BlendedImage image;
    {
        const DeviceWork work;
        image = operators(work).blend(arguments.splats(), DepthOrder{span_of(order), span_of(sizes)},
                                      arguments.options);
    }
    return arguments.result(std::move(image));
}

nb::tuple blend_lists(nb::handle means2d, nb::handle conics, nb::handle opacities, nb::handle features,
                      int width, int height, nb::handle background, nb::handle tile_mask, int tile_size,
                      nb::handle offsets, nb::handle ids, bool keep, bool whiteners) {
    const BlendArguments arguments(means2d, conics, opacities, features, width, height, background, tile_mask,
                                   tile_size, keep, whiteners);
    const Array<int32_t> begins(offsets, "offsets", Shape{any('T')}), listed(ids, "ids", Shape{any('n')});
    BlendedImage image;
    {
        const DeviceWork work;
        const TileLists lists{arguments.options.mask_tile_size, span_of(begins), span_of(listed)};
        image = operators(work).blend(arguments.splats(), lists, arguments.options);
    }
    return arguments.result(std::move(image));
}

nb::tuple blend_backward(const BlendHandle& handle, nb::handle features_gradient, nb::handle alphas_gradient,
                         bool absolute) {
    const auto h = ptrdiff_t(handle.height), w = ptrdiff_t(handle.width), d = ptrdiff_t(handle.channels);
    const Array<float> features(features_gradient, "v_image", {h, w, d});
    const auto alphas = optional_array<float>(alphas_gradient, "v_alpha", {h, w});
    ScreenGradient g;
    {
        const DeviceWork work;
        g = operators(work).blend_backward(*handle.kept->record, span_of(features), span_of(alphas),
                                           absolute);
    }
    const size_t m = handle.splats;
    return nb::make_tuple(to_numpy(std::move(g.means2d), {m, 2}), to_numpy(std::move(g.conics), {m, 3}),
                          to_numpy(std::move(g.opacities), {m}),
                          to_numpy(std::move(g.features), {m, handle.channels}),
                          to_numpy(std::move(g.background), {handle.channels}),
                          array_or_none(std::move(g.absolute), {m, 2}, absolute));
}

}  // namespace

void bind_operators(nb::module_& module) {
    nb::module_ own = module.def_submodule("operators",
                                           "The steps of splatting with gradients, on arrays. "
                                           "include/ewa/operators.h has the formulas.");
    nb::class_<BlendHandle>(own, "BlendHandle",
                            "What blend_backward needs of an image. It holds device memory.");
    own.def("blend", blend, nb::arg("means2d"), nb::arg("conics"), nb::arg("depths"), nb::arg("opacities"),
            nb::arg("features"), nb::arg("radii").none(), nb::arg("width"), nb::arg("height"),
            nb::arg("background").none(), nb::arg("tile_mask").none(), nb::arg("tile_size"), nb::arg("keep"),
            nb::arg("whiteners") = false,
            "Blends M splats, nearest first: (image [H, W, D], alpha [H, W], handle or None).");
    own.def("blend_lists", blend_lists, nb::arg("means2d"), nb::arg("conics"), nb::arg("opacities"),
            nb::arg("features"), nb::arg("width"), nb::arg("height"), nb::arg("background").none(),
            nb::arg("tile_mask").none(), nb::arg("tile_size"), nb::arg("offsets"), nb::arg("ids"),
            nb::arg("keep"), nb::arg("whiteners") = false,
            "Blends the lists of the caller's tiles, in their order.");
    own.def("blend_backward", blend_backward, nb::arg("handle"), nb::arg("v_image"),
            nb::arg("v_alpha").none(), nb::arg("absolute"),
            "Gradients by means2d, conics, opacities, features, background, and absgrad or None.");
}

}  // namespace ewa::python
