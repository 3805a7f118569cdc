// SPDX-License-Identifier: Apache-2.0
// ewa._native.operators: libewa's operators on arrays. ewa.gsplat is built on them.
#include "ewa/operators.h"

#include <nanobind/stl/pair.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <algorithm>
#include <functional>
#include <initializer_list>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "arrays.h"
#include "bindings.h"
#include "cameras.h"
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

/// Part i of an array in `parts` equal parts.
template <class A>
auto part_of(const A& array, size_t i, size_t parts) {
    const auto all = span_of(array);
    return all.subspan(i * (all.size() / parts), all.size() / parts);
}

template <class T>
void append(std::vector<T>& to, std::vector<T>&& more) {
    if (to.empty())
        to = std::move(more);
    else
        to.insert(to.end(), more.begin(), more.end());
}

Shape joined(Shape shape, std::initializer_list<ptrdiff_t> more) {
    shape.insert(shape.end(), more);
    return shape;
}

/// An argument that may be None.
template <class T>
std::optional<Array<T>> optional_array(nb::handle value, const char* name, const Shape& shape) {
    if (value.is_none()) return std::nullopt;
    return std::optional<Array<T>>(std::in_place, value, name, shape);
}

template <class T>
nb::object array_or_none(std::vector<T>&& values, const Shape& shape, bool there = true) {
    if (!there) return nb::none();
    return nb::cast(to_numpy(std::move(values), std::vector<size_t>(shape.begin(), shape.end())));
}

uint32_t pixels(int value, const char* name) {
    if (value <= 0) throw InputError(std::string(name) + " is " + std::to_string(value) + ", not above zero");
    return uint32_t(value);
}

/// Footprints, or the gradients by them: arrays of the same leading lengths. None: not known, or zero.
struct Footprints {
    std::optional<Array<float>> means2d, conics, depths, compensations, opacities, features;
    std::optional<Array<int32_t>> radii;
    Shape lead{kLeading};

    Footprints(nb::handle m, nb::handle c, nb::handle d, nb::handle r, nb::handle factors, nb::handle o,
               nb::handle f) {
        read(means2d, m, "means2d", {2});
        read(conics, c, "conics", {3});
        read(depths, d, "depths", {});
        read(radii, r, "radii", {2});
        read(compensations, factors, "compensations", {});
        read(opacities, o, "opacities", {});
        read(features, f, "features", {any('D')});
    }

  private:
    template <class T>
    void read(std::optional<Array<T>>& array, nb::handle value, const char* name,
              std::initializer_list<ptrdiff_t> row) {
        if (value.is_none()) return;
        array.emplace(value, name, joined(lead, row));
        lead = array->leading(row.size());
    }
};

/// Throws InputError if an array that an operator needs is None.
template <class T>
void need(const std::optional<Array<T>>& array, const char* name) {
    if (!array) throw InputError(std::string("footprints without ") + name);
}

template <auto member>
nb::object field(const Footprints& footprints) {
    const auto& array = footprints.*member;
    return array ? array->numpy() : nb::none();
}

/// Splats [..., N], cameras [..., C] that see them, and what a projection takes beside them.
class Projection {
  public:
    Projection(nb::handle m, nb::handle q, nb::handle s, nb::handle c, nb::handle o, nb::handle v,
               nb::handle k, int width, int height, float eps2d, float near, float far, float radius_clip,
               bool compensations, const std::string& camera_model, nb::handle distortions)
        : means_(m, "means", {kLeading, any('N'), 3}),
          quats_(optional_array<float>(q, "quats", joined(means_.leading(1), {4}))),
          scales_(optional_array<float>(s, "scales", joined(means_.leading(1), {3}))),
          covars_(optional_array<float>(c, "covars", joined(means_.leading(1), {6}))),
          opacities_(optional_array<float>(o, "opacities", means_.leading(1))),
          viewmats_(v, "viewmats", joined(means_.leading(2), {any('C'), 4, 4})),
          intrinsics_(k, "Ks", joined(viewmats_.leading(2), {3, 3})),
          options_{.width = pixels(width, "width"),
                   .height = pixels(height, "height"),
                   .low_pass = eps2d,
                   .near = near,
                   .far = far,
                   .radius_clip = radius_clip,
                   .compensations = compensations} {
        if (covars_ ? quats_ || scales_ : !quats_ || !scales_)
            throw InputError("a splat has quats and scales, or covars; neither more nor less");
        for (const ptrdiff_t length : means_.leading(2)) scenes_ *= size_t(length);
        if (camera_model == "pinhole" && distortions.is_none()) return;
        lenses_ = distortions_of(camera_model, distortions, viewmats_.leading(2), intrinsics_.size() / 9);
    }

    Footprints footprints() const {
        ProjectedSplats all;
        {
            const DeviceWork work;
            for (size_t i = 0; i < scenes_; ++i) {
                ProjectedSplats p = operators(work).project(splats(i), views(i), options_);
                append(all.radii, std::move(p.radii));
                append(all.means2d, std::move(p.means2d));
                append(all.depths, std::move(p.depths));
                append(all.conics, std::move(p.conics));
                append(all.compensations, std::move(p.compensations));
            }
        }
        const Shape lead = joined(viewmats_.leading(2), {means_.leading(1).back()});
        return {array_or_none(std::move(all.means2d), joined(lead, {2})),
                array_or_none(std::move(all.conics), joined(lead, {3})),
                array_or_none(std::move(all.depths), lead),
                array_or_none(std::move(all.radii), joined(lead, {2})),
                array_or_none(std::move(all.compensations), lead, options_.compensations),
                nb::none(),
                nb::none()};
    }

    nb::tuple gradients(const Footprints& by, bool need_viewmats) const {
        need(by.radii, "radii");
        SplatGradient all;
        {
            const DeviceWork work;
            for (size_t i = 0; i < scenes_; ++i) {
                const auto part = [&](const auto& array) { return part_of(array, i, scenes_); };
                SplatGradient g = operators(work).project_backward(
                    splats(i), views(i), options_, part(by.radii),
                    {part(by.means2d), part(by.depths), part(by.conics), part(by.compensations)},
                    need_viewmats);
                append(all.means, std::move(g.means));
                append(all.quaternions, std::move(g.quaternions));
                append(all.scales, std::move(g.scales));
                append(all.covariances, std::move(g.covariances));
                append(all.view_matrices, std::move(g.view_matrices));
            }
        }
        const Shape rows = means_.leading(1);
        return nb::make_tuple(
            array_or_none(std::move(all.means), joined(rows, {3})),
            array_or_none(std::move(all.quaternions), joined(rows, {4}), quats_.has_value()),
            array_or_none(std::move(all.scales), joined(rows, {3}), quats_.has_value()),
            array_or_none(std::move(all.covariances), joined(rows, {6}), covars_.has_value()),
            array_or_none(std::move(all.view_matrices), viewmats_.leading(0), need_viewmats));
    }

  private:
    SplatArrays splats(size_t i) const {
        return {part_of(means_, i, scenes_), part_of(quats_, i, scenes_), part_of(scales_, i, scenes_),
                part_of(covars_, i, scenes_), part_of(opacities_, i, scenes_)};
    }
    ViewArrays views(size_t i) const {
        const size_t each = lenses_.size() / scenes_;
        return {part_of(viewmats_, i, scenes_), part_of(intrinsics_, i, scenes_),
                std::span(lenses_).subspan(i * each, each)};
    }

    Array<float> means_;
    std::optional<Array<float>> quats_, scales_, covars_, opacities_;
    Array<float> viewmats_, intrinsics_;
    std::vector<Distortion> lenses_;  // empty: pinholes
    ProjectionOptions options_;
    size_t scenes_ = 1;
};

/// Images of footprints, each of a range of their rows, and what the gradients by them need.
class Blending {
  public:
    using Range = std::pair<size_t, size_t>;
    using Lists = std::vector<std::pair<nb::object, nb::object>>;

    Blending(const Footprints& footprints, std::vector<Range> rows, int width, int height, int tile_size,
             nb::handle backgrounds, nb::handle masks, const Lists& lists)
        : footprints_(footprints),
          rows_(std::move(rows)),
          backgrounds_(optional_array<float>(backgrounds, "backgrounds", {kLeading, any('D')})),
          masks_(optional_array<uint8_t>(masks, "masks", {kLeading, any('H'), any('W')})),
          options_{.width = pixels(width, "width"),
                   .height = pixels(height, "height"),
                   .mask_tile_size = pixels(tile_size, "tile_size")} {
        need(footprints_.means2d, "means2d");
        need(footprints_.conics, "conics");
        need(footprints_.opacities, "opacities");
        need(footprints_.features, "features");
        for (const auto& [start, stop] : rows_)
            if (start > stop || stop > size())
                throw InputError("rows from " + std::to_string(start) + " to " + std::to_string(stop) +
                                 " of " + std::to_string(size()) + " footprints");
        for (const auto& [offsets, ids] : lists)
            lists_.push_back({{offsets, "offsets", Shape{any('T')}}, {ids, "ids", Shape{any('n')}}});
        if (lists.empty() && !rows_.empty()) need(footprints_.depths, "depths");
        if (!lists.empty() && lists.size() != rows_.size())
            throw InputError(std::to_string(lists.size()) + " lists of " + std::to_string(rows_.size()) +
                             " images");
    }

    nb::tuple blend(bool keep) {
        BlendedImage all;
        OnDevice<Records> records(std::make_unique<Records>());
        std::vector<uint32_t> skipped;
        {
            const DeviceWork work;
            for (size_t i = 0; i < rows_.size(); ++i) {
                BlendedImage blended = image(operators(work), i, keep);
                append(all.features, std::move(blended.features));
                append(all.alphas, std::move(blended.alphas));
                if (keep) records->push_back(std::move(blended.record));
                skipped.push_back(blended.skipped_nonfinite);
            }
        }
        records_ = std::move(records);
        for (size_t i = 0; i < skipped.size(); ++i)
            if (skipped[i] > 0)
                warn(PyExc_RuntimeWarning,
                     std::to_string(skipped[i]) + " of " + std::to_string(rows_[i].second - rows_[i].first) +
                         " splats skipped: a mean, conic, opacity, depth or colour is not finite, or a conic "
                         "is not positive definite");
        const auto images = ptrdiff_t(rows_.size());
        return nb::make_tuple(array_or_none(std::move(all.features), images_of(images, channels())),
                              array_or_none(std::move(all.alphas), images_of(images, 1)));
    }

    nb::tuple gradients(nb::handle v_images, nb::handle v_alphas, bool absolute) const {
        const auto by_images = optional_array<float>(v_images, "v_images", images_of(kLeading, channels())),
                   by_alphas = optional_array<float>(v_alphas, "v_alphas", images_of(kLeading, 1));
        if (records_->size() != rows_.size()) throw InputError("images whose gradients were not kept");
        const bool whole = rows_.size() == 1 && rows_[0] == Range(0, size());
        const size_t m = whole ? 0 : size(), d = channels();
        ScreenGradient all{.means2d = std::vector<float>(2 * m),
                           .conics = std::vector<float>(3 * m),
                           .opacities = std::vector<float>(m),
                           .features = std::vector<float>(d * m),
                           .background = {},
                           .absolute = std::vector<float>(absolute ? 2 * m : 0)};
        {
            const DeviceWork work;
            const std::vector<float> zeros(by_images ? 0 : d * options_.width * options_.height);
            for (size_t i = 0; i < rows_.size(); ++i) {
                ScreenGradient g = operators(work).blend_backward(
                    *(*records_)[i], by_images ? part_of(by_images, i, rows_.size()) : std::span(zeros),
                    part_of(by_alphas, i, rows_.size()), absolute);
                append(all.background, std::move(g.background));
                const auto add = [&](std::vector<float>& to, std::vector<float>& from, size_t width) {
                    if (whole) return to.swap(from);
                    float* row = to.data() + width * rows_[i].first;
                    std::transform(from.begin(), from.end(), row, row, std::plus());
                };
                add(all.means2d, g.means2d, 2);
                add(all.conics, g.conics, 3);
                add(all.opacities, g.opacities, 1);
                add(all.features, g.features, d);
                add(all.absolute, g.absolute, 2);
            }
        }
        const Shape& lead = footprints_.lead;
        return nb::make_tuple(
            Footprints(array_or_none(std::move(all.means2d), joined(lead, {2})),
                       array_or_none(std::move(all.conics), joined(lead, {3})), nb::none(), nb::none(),
                       nb::none(), array_or_none(std::move(all.opacities), lead),
                       array_or_none(std::move(all.features), joined(lead, {ptrdiff_t(d)}))),
            array_or_none(std::move(all.background), {ptrdiff_t(rows_.size()), ptrdiff_t(d)}),
            array_or_none(std::move(all.absolute), joined(lead, {2}), absolute));
    }

  private:
    using Records = std::vector<std::shared_ptr<BlendRecord>>;
    struct TileArrays {
        Array<int32_t> offsets, splats;
    };

    size_t size() const { return footprints_.opacities->size(); }
    size_t channels() const { return footprints_.features->length(footprints_.lead.size()); }
    Shape images_of(ptrdiff_t count, size_t depth) const {
        return {count, ptrdiff_t(options_.height), ptrdiff_t(options_.width), ptrdiff_t(depth)};
    }
    BlendedImage image(Operators& operators, size_t i, bool keep) const {
        const Range range = rows_[i];
        const auto rows = [&](const auto& array, size_t width) {
            return span_of(array).subspan(range.first * width, (range.second - range.first) * width);
        };
        const ScreenSplats splats{.means2d = rows(footprints_.means2d, 2),
                                  .conics = rows(footprints_.conics, 3),
                                  .opacities = rows(footprints_.opacities, 1),
                                  .features = rows(footprints_.features, channels()),
                                  .channels = uint32_t(channels())};
        BlendOptions options = options_;
        options.background = part_of(backgrounds_, i, rows_.size());
        options.tile_mask = part_of(masks_, i, rows_.size());
        options.gradients = keep;
        if (!lists_.empty()) {
            const TileLists lists{options.mask_tile_size, span_of(lists_[i].offsets),
                                  span_of(lists_[i].splats)};
            return operators.blend(splats, lists, options);
        }
        DepthOrder order{rows(footprints_.depths, 1)};
        if (footprints_.radii) order.radii = rows(footprints_.radii, 2);
        return operators.blend(splats, order, options);
    }

    Footprints footprints_;
    std::vector<Range> rows_;
    std::optional<Array<float>> backgrounds_;
    std::optional<Array<uint8_t>> masks_;
    std::vector<TileArrays> lists_;
    BlendOptions options_;
    OnDevice<Records> records_{std::make_unique<Records>()};  // with what gradients need
};

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
                          array_or_none(std::move(g.directions), a.dirs.leading(0), need_dirs));
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
    nb::class_<Footprints>(own, "Footprints",
                           "Splats in images [...], or the gradients by them. None: not known, or zero.")
        .def(nb::init<nb::handle, nb::handle, nb::handle, nb::handle, nb::handle, nb::handle, nb::handle>(),
             nb::arg("means2d") = nb::none(), nb::arg("conics") = nb::none(), nb::arg("depths") = nb::none(),
             nb::arg("radii") = nb::none(), nb::arg("compensations") = nb::none(),
             nb::arg("opacities") = nb::none(), nb::arg("features") = nb::none())
        .def_prop_ro("means2d", field<&Footprints::means2d>, "[..., 2]")
        .def_prop_ro("conics", field<&Footprints::conics>, "[..., 3]")
        .def_prop_ro("depths", field<&Footprints::depths>, "[...]")
        .def_prop_ro("radii", field<&Footprints::radii>, "[..., 2]")
        .def_prop_ro("compensations", field<&Footprints::compensations>, "[...]")
        .def_prop_ro("opacities", field<&Footprints::opacities>, "[...]")
        .def_prop_ro("features", field<&Footprints::features>, "[..., D]");
    nb::class_<Projection>(own, "Projection", "Splats [..., N] in the views of cameras [..., C].")
        .def(nb::init<nb::handle, nb::handle, nb::handle, nb::handle, nb::handle, nb::handle, nb::handle, int,
                      int, float, float, float, float, bool, const std::string&, nb::handle>(),
             nb::arg("means"), nb::arg("quats").none(), nb::arg("scales").none(), nb::arg("covars").none(),
             nb::arg("opacities").none(), nb::arg("viewmats"), nb::arg("Ks"), nb::arg("width"),
             nb::arg("height"), nb::arg("eps2d"), nb::arg("near"), nb::arg("far"), nb::arg("radius_clip"),
             nb::arg("compensations"), nb::arg("camera_model"), nb::arg("distortions").none())
        .def("footprints", &Projection::footprints, "Footprints [..., C, N], with radii.")
        .def("gradients", &Projection::gradients, nb::arg("by"), nb::arg("need_viewmats"),
             "Gradients by means, quats, scales, covars and viewmats; None for what there is not. by: the "
             "gradients by the footprints, and their radii.");
    nb::class_<Blending>(own, "Blending",
                         "Images of footprints. Image i has those from rows[i][0] to rows[i][1], nearest "
                         "first, or as lists[i] says: each tile's offset, and footprints of the rows.")
        .def(nb::init<const Footprints&, std::vector<Blending::Range>, int, int, int, nb::handle, nb::handle,
                      const Blending::Lists&>(),
             nb::arg("footprints"), nb::arg("rows"), nb::arg("width"), nb::arg("height"),
             nb::arg("tile_size"), nb::arg("backgrounds") = nb::none(), nb::arg("masks") = nb::none(),
             nb::arg("lists") = Blending::Lists())
        .def("blend", &Blending::blend, nb::arg("keep"),
             "Images [I, H, W, D] and alphas [I, H, W, 1]. keep: what gradients need, in device memory.")
        .def("gradients", &Blending::gradients, nb::arg("v_images").none(), nb::arg("v_alphas").none(),
             nb::arg("absolute"), "Gradients by footprints, backgrounds [I, D], and absgrad or None.");
    own.def("spherical_harmonics", spherical_harmonics, nb::arg("degree"), nb::arg("dirs"), nb::arg("coeffs"),
            nb::arg("masks").none(), "Colours [C, N, D] of N splats seen along C directions each.");
    own.def("spherical_harmonics_backward", spherical_harmonics_backward, nb::arg("degree"), nb::arg("dirs"),
            nb::arg("coeffs"), nb::arg("masks").none(), nb::arg("v_colors"), nb::arg("need_dirs"),
            "Gradients by coeffs, and by dirs or None.");
}

}  // namespace ewa::python
