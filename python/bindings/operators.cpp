// SPDX-License-Identifier: Apache-2.0
// ewa._native.operators: libewa's operators on arrays. ewa.gsplat is built on them.
#include "ewa/operators.h"

#include <nanobind/stl/optional.h>
#include <nanobind/stl/string.h>

#include <optional>

#include "arrays.h"
#include "bindings.h"
#include "device.h"
#include "errors.h"
#include "ewa/error.h"
#include "shared/constants.h"
#include "shared/layouts.h"

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
        if (image.skipped_nonfinite > 0) {
            warn(PyExc_RuntimeWarning,
                 std::to_string(image.skipped_nonfinite) + " of " + std::to_string(size()) +
                     " splats skipped: a mean, conic, opacity, depth or colour is not finite, or a conic is "
                     "not positive definite");
        }
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

/// The arguments that a projection and its gradient have.
struct ProjectionArguments {
    Array<float> means;
    std::optional<Array<float>> quats, scales, covars, opacities;
    Array<float> viewmats, intrinsics;
    ProjectionOptions options;

    ProjectionArguments(nb::handle m, nb::handle q, nb::handle s, nb::handle c, nb::handle o, nb::handle v,
                        nb::handle k, int width, int height, float eps2d)
        : means(m, "means", {any('N'), 3}),
          quats(optional_array<float>(q, "quats", {n(), 4})),
          scales(optional_array<float>(s, "scales", {n(), 3})),
          covars(optional_array<float>(c, "covars", {n(), 6})),
          opacities(optional_array<float>(o, "opacities", Shape{n()})),
          viewmats(v, "viewmats", {any('C'), 4, 4}),
          intrinsics(k, "Ks", {ptrdiff_t(viewmats.length(0)), 3, 3}) {
        if (covars ? quats || scales : !quats || !scales)
            throw InputError("a splat has quats and scales, or covars; neither more nor less");
        options.width = pixels(width, "width");
        options.height = pixels(height, "height");
        options.low_pass = eps2d;
    }

    ptrdiff_t n() const { return ptrdiff_t(means.length(0)); }
    size_t splat_count() const { return means.length(0); }
    size_t view_count() const { return viewmats.length(0); }
    SplatArrays splats() const {
        return {span_of(means), span_of(quats), span_of(scales), span_of(covars), span_of(opacities)};
    }
    ViewArrays views() const { return {span_of(viewmats), span_of(intrinsics)}; }
};

nb::tuple project(nb::handle means, nb::handle quats, nb::handle scales, nb::handle covars,
                  nb::handle opacities, nb::handle viewmats, nb::handle intrinsics, int width, int height,
                  float eps2d, float near, float far, float radius_clip, bool compensations) {
    ProjectionArguments a(means, quats, scales, covars, opacities, viewmats, intrinsics, width, height,
                          eps2d);
    a.options.near = near;
    a.options.far = far;
    a.options.radius_clip = radius_clip;
    a.options.compensations = compensations;
    ProjectedSplats p;
    {
        const DeviceWork work;
        p = operators(work).project(a.splats(), a.views(), a.options);
    }
    const size_t c = a.view_count(), n = a.splat_count();
    return nb::make_tuple(to_numpy(std::move(p.radii), {c, n, 2}), to_numpy(std::move(p.means2d), {c, n, 2}),
                          to_numpy(std::move(p.depths), {c, n}), to_numpy(std::move(p.conics), {c, n, 3}),
                          array_or_none(std::move(p.compensations), {c, n}, compensations));
}

nb::tuple project_backward(nb::handle means, nb::handle quats, nb::handle scales, nb::handle covars,
                           nb::handle viewmats, nb::handle intrinsics, int width, int height, float eps2d,
                           nb::handle radii, nb::handle v_means2d, nb::handle v_depths, nb::handle v_conics,
                           nb::handle v_compensations, bool need_viewmats) {
    const ProjectionArguments a(means, quats, scales, covars, nb::none(), viewmats, intrinsics, width, height,
                                eps2d);
    const auto c = ptrdiff_t(a.view_count()), n = a.n();
    const Array<int32_t> sizes(radii, "radii", {c, n, 2});
    const auto by_means = optional_array<float>(v_means2d, "v_means2d", {c, n, 2}),
               by_depths = optional_array<float>(v_depths, "v_depths", {c, n}),
               by_conics = optional_array<float>(v_conics, "v_conics", {c, n, 3}),
               by_compensations = optional_array<float>(v_compensations, "v_compensations", {c, n});
    SplatGradient g;
    {
        const DeviceWork work;
        g = operators(work).project_backward(
            a.splats(), a.views(), a.options, span_of(sizes),
            {span_of(by_means), span_of(by_depths), span_of(by_conics), span_of(by_compensations)},
            need_viewmats);
    }
    const size_t count = a.splat_count();
    const bool covariances = a.covars.has_value();
    return nb::make_tuple(to_numpy(std::move(g.means), {count, 3}),
                          array_or_none(std::move(g.quaternions), {count, 4}, !covariances),
                          array_or_none(std::move(g.scales), {count, 3}, !covariances),
                          array_or_none(std::move(g.covariances), {count, 6}, covariances),
                          array_or_none(std::move(g.view_matrices), {a.view_count(), 4, 4}, need_viewmats));
}

/// The arguments that spherical harmonics and their gradient have.
struct HarmonicsArguments {
    Array<float> dirs, coeffs;
    std::optional<Array<uint8_t>> masks;
    int degree;

    HarmonicsArguments(int d, nb::handle directions, nb::handle coefficients, nb::handle mask)
        : dirs(directions, "dirs", {any('C'), any('N'), 3}),
          coeffs(coefficients, "coeffs", {ptrdiff_t(dirs.length(1)), any('K'), any('D')}),
          masks(
              optional_array<uint8_t>(mask, "masks", {ptrdiff_t(dirs.length(0)), ptrdiff_t(dirs.length(1))})),
          degree(d) {
        if (degree < 0) throw InputError("degree is " + std::to_string(degree) + ", below zero");
    }
    size_t views() const { return dirs.length(0); }
    size_t splats() const { return dirs.length(1); }
    size_t channels() const { return coeffs.length(2); }
    HarmonicsArrays arrays() const {
        return {uint32_t(degree),     uint32_t(coeffs.length(1)),
                uint32_t(channels()), span_of(dirs),
                span_of(coeffs),      span_of(masks)};
    }
};

nb::object spherical_harmonics(int degree, nb::handle dirs, nb::handle coeffs, nb::handle masks) {
    const HarmonicsArguments a(degree, dirs, coeffs, masks);
    std::vector<float> colors;
    {
        const DeviceWork work;
        colors = operators(work).spherical_harmonics(a.arrays());
    }
    return nb::cast(to_numpy(std::move(colors), {a.views(), a.splats(), a.channels()}));
}

nb::tuple spherical_harmonics_backward(int degree, nb::handle dirs, nb::handle coeffs, nb::handle masks,
                                       nb::handle v_colors, bool need_dirs) {
    const HarmonicsArguments a(degree, dirs, coeffs, masks);
    const Array<float> incoming(v_colors, "v_colors",
                                {ptrdiff_t(a.views()), ptrdiff_t(a.splats()), ptrdiff_t(a.channels())});
    HarmonicsGradient g;
    {
        const DeviceWork work;
        g = operators(work).spherical_harmonics_backward(a.arrays(), span_of(incoming), need_dirs);
    }
    return nb::make_tuple(to_numpy(std::move(g.coefficients), {a.splats(), a.coeffs.length(1), a.channels()}),
                          array_or_none(std::move(g.directions), {a.views(), a.splats(), 3}, need_dirs));
}

}  // namespace

void bind_operators(nb::module_& module) {
    nb::module_ own = module.def_submodule("operators",
                                           "The steps of splatting with gradients, on arrays. "
                                           "include/ewa/operators.h has the formulas.");
    own.attr("ALPHA_MIN") = shared::ALPHA_MIN;
    own.attr("ALPHA_MAX") = shared::ALPHA_MAX;
    own.attr("COLOR_OFFSET") = shared::COLOR_OFFSET;
    own.attr("FAR_PLANE") = ProjectionOptions().far;
    own.attr("JACOBIAN_MARGIN") = shared::JACOBIAN_MARGIN;
    own.attr("LOW_PASS") = shared::LOW_PASS;
    own.attr("MAX_SH_DEGREE") = kMaxHarmonicsDegree;
    own.attr("MCMC_GATE_OPACITY") = shared::MCMC_GATE_OPACITY;
    own.attr("MCMC_GATE_SLOPE") = shared::MCMC_GATE_SLOPE;
    own.attr("NEAR_PLANE") = shared::NEAR_PLANE;
    own.attr("PART_SIZE") = shared::PART_SIZE;
    own.attr("RADIUS_SIGMAS") = shared::RADIUS_SIGMAS;
    own.attr("SH_C0") = shared::SH_C0;
    own.attr("SPLIT_SCALE") = shared::SPLIT_SCALE;
    own.attr("TILE_SIZE") = TileLists().tile_size;
    own.attr("TRANSMITTANCE_STOP") = shared::TRANSMITTANCE_STOP;
    nb::class_<BlendHandle>(own, "BlendHandle",
                            "What blend_backward needs of an image. It holds device memory.");
    own.def("project", project, nb::arg("means"), nb::arg("quats").none(), nb::arg("scales").none(),
            nb::arg("covars").none(), nb::arg("opacities").none(), nb::arg("viewmats"), nb::arg("Ks"),
            nb::arg("width"), nb::arg("height"), nb::arg("eps2d"), nb::arg("near"), nb::arg("far"),
            nb::arg("radius_clip"), nb::arg("compensations"),
            "Projects N splats into C views: radii [C, N, 2], means2d, depths, conics, and compensations or "
            "None.");
    own.def("project_backward", project_backward, nb::arg("means"), nb::arg("quats").none(),
            nb::arg("scales").none(), nb::arg("covars").none(), nb::arg("viewmats"), nb::arg("Ks"),
            nb::arg("width"), nb::arg("height"), nb::arg("eps2d"), nb::arg("radii"),
            nb::arg("v_means2d").none(), nb::arg("v_depths").none(), nb::arg("v_conics").none(),
            nb::arg("v_compensations").none(), nb::arg("need_viewmats"),
            "Gradients by means, quats, scales, covars and viewmats; None for what there is not.");
    own.def("spherical_harmonics", spherical_harmonics, nb::arg("degree"), nb::arg("dirs"), nb::arg("coeffs"),
            nb::arg("masks").none(), "Colours [C, N, D] of N splats seen along C directions each.");
    own.def("spherical_harmonics_backward", spherical_harmonics_backward, nb::arg("degree"), nb::arg("dirs"),
            nb::arg("coeffs"), nb::arg("masks").none(), nb::arg("v_colors"), nb::arg("need_dirs"),
            "Gradients by coeffs, and by dirs or None.");
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
