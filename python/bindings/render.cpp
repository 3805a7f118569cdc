// SPDX-License-Identifier: Apache-2.0
#include "ewa/renderer.h"

#include <nanobind/stl/array.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/string.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "bindings.h"
#include "cameras.h"
#include "core/typing.h"
#include "core/words.h"
#include "device.h"
#include "errors.h"
#include "ewa/error.h"
#include "images.h"
#include "inputs.h"
#include "options.h"

namespace ewa::python {
namespace {

/// The renders of one call. Arrays that were not asked for are None.
struct Renders {
    nb::object color, alpha, depth, count, median_depth, normal;
};

std::string renders_text(const Renders& renders) {
    std::string text = "Renders(";
    for (const auto& [name, array] :
         {std::pair("color", &renders.color), std::pair("alpha", &renders.alpha),
          std::pair("depth", &renders.depth), std::pair("count", &renders.count),
          std::pair("median_depth", &renders.median_depth), std::pair("normal", &renders.normal)})
        if (!array->is_none())
            text.append(text.back() == '(' ? "" : ", ")
                .append(name)
                .append(" ")
                .append(nb::repr(nb::list(array->attr("shape"))).c_str());
    return text + ")";
}

/// The colours of all renders side by side.
nb::bytes renders_png(const Renders& renders) {
    const Array<float> color(renders.color, "color",
                             {Shape{any('C'), any('H'), any('W'), 3}, Shape{any('H'), any('W'), 3}});
    const bool batch = color.dimensions() == 4;
    constexpr size_t kMostShown = 8;
    const size_t count = batch ? std::min(color.length(0), kMostShown) : 1;
    const size_t height = color.length(batch ? 1 : 0), width = color.length(batch ? 2 : 1);
    if (count * width * height == 0) return nb::bytes("", 0);
    Image all(int(count * width), int(height), 3);
    for (size_t i = 0; i < count; ++i)
        for (size_t y = 0; y < height; ++y)
            std::copy_n(color.data() + (i * height + y) * width * 3, width * 3,
                        &all.pixels[(y * count + i) * width * 3]);
    return png_bytes(all);
}

/// What was wrong with the splats or cameras of a call.
struct Doubts {
    uint32_t skipped = 0;
    std::optional<size_t> unseen;  // the first camera that sees no splat

    void warn_of(size_t splats) const {
        if (skipped > 0)
            warn(PyExc_RuntimeWarning, std::to_string(skipped) + " of " + core::counted(splats, "splat") +
                                           " skipped: a value is not finite, or a quaternion is zero");
        if (unseen && skipped < splats)
            warn(PyExc_RuntimeWarning,
                 "the camera of viewmats[" + std::to_string(*unseen) +
                     "] sees no splat; viewmats map the world to the camera: numpy.linalg.inv makes them of "
                     "camera-to-world matrices");
    }
};

/// The images of one kind, one after the other.
class Planes {
  public:
    Planes(size_t cameras, int width, int height, size_t channels)
        : shape_{cameras, size_t(height), size_t(width), channels} {}
    void set(size_t camera, const Image& image) {
        values_.resize(
            shape_[0] *
            image.pixels.size());  // only now: a size that is too large is an error of the renderer's
        std::copy(image.pixels.begin(), image.pixels.end(),
                  values_.begin() + std::ptrdiff_t(camera * image.pixels.size()));
    }
    nb::object array(bool batch) {
        if (!batch) shape_.erase(shape_.begin());
        return nb::cast(to_numpy(std::move(values_), shape_));
    }

  private:
    std::vector<size_t> shape_;
    std::vector<float> values_;
};

Drawing drawing_of(const std::string& mode) {
    static const core::Words<Drawing> modes{
        {"color", Drawing::color},   {"depth", Drawing::depth}, {"median-depth", Drawing::median_depth},
        {"normal", Drawing::normal}, {"count", Drawing::count}, {"ellipsoids", Drawing::ellipsoids}};
    return of_argument("mode", [&] { return core::value_of(modes, mode); });
}

/// The array that a mode adds to those of the colours; null: none.
nb::object Renders::*array_of(Drawing drawing) {
    if (drawing == Drawing::depth) return &Renders::depth;
    if (drawing == Drawing::count) return &Renders::count;
    if (drawing == Drawing::median_depth) return &Renders::median_depth;
    return drawing == Drawing::normal ? &Renders::normal : nullptr;
}

const Image& image_of(const Rendering& rendering, Drawing drawing) {
    if (drawing == Drawing::depth) return rendering.depth;
    if (drawing == Drawing::count) return rendering.count;
    return drawing == Drawing::median_depth ? rendering.median_depth : rendering.normal;
}

/// ewa.Renderer: a scene on the device.
class SceneRenderer {
  public:
    SceneRenderer(const Splats& splats, const LookArguments& look) : options_(look_of(look, splats)) {
        splats_ = splats.gaussians.size();
        const DeviceWork work;
        Gaussians fitted;
        renderer_ = OnDevice(
            std::make_unique<Renderer>(work.device(), fitted_to(options_.kernel, splats, fitted), options_));
    }

    void replace(const ObjectOrPath<Splats>& given) {
        const Opened<Splats> opened(given, open_splats);
        const Splats& splats = *opened;
        splats_ = splats.gaussians.size();
        const DeviceWork work;
        Gaussians fitted;
        renderer_->replace(fitted_to(options_.kernel, splats, fitted));
    }

    Renders render(nb::handle viewmats, nb::handle intrinsics, int width, int height, nb::handle background,
                   const std::string& mode, const std::string& camera_model, nb::object distortion,
                   const std::string& rolling_shutter, nb::object viewmats_end) {
        const Cameras cameras =
            cameras_of(viewmats, intrinsics, width, height, {camera_model, std::move(distortion)},
                       {rolling_shutter, std::move(viewmats_end)});
        DrawOptions options{.render = options_, .drawing = drawing_of(mode)};
        use_background(options.render, background);
        const size_t count = cameras.all.size();
        Planes color(count, width, height, 3), alpha(count, width, height, 1);
        std::optional<Planes> more;
        nb::object Renders::*const added = array_of(options.drawing);
        if (added) more.emplace(count, width, height, options.drawing == Drawing::normal ? 3 : 1);
        draw(cameras.all, options, color, alpha, more ? &*more : nullptr).warn_of(splats_);
        Renders renders{color.array(cameras.batch),
                        alpha.array(cameras.batch),
                        nb::none(),
                        nb::none(),
                        nb::none(),
                        nb::none()};
        if (more) renders.*added = more->array(cameras.batch);
        return renders;
    }

  private:
    Doubts draw(const std::vector<Camera>& cameras, const DrawOptions& options, Planes& color, Planes& alpha,
                Planes* more) {
        Doubts doubts;
        const DeviceWork work;
        // A render of surfaces has no colours.
        const bool surface = options.drawing == Drawing::median_depth || options.drawing == Drawing::normal;
        DrawOptions first = options;
        if (surface) first.drawing = Drawing::color;
        for (size_t i = 0; i < cameras.size(); ++i) {
            const Rendering rendering = renderer_->render(cameras[i], first);
            color.set(i, rendering.color);
            alpha.set(i, rendering.alpha);
            if (surface)
                more->set(i, image_of(renderer_->render(cameras[i], options), options.drawing));
            else if (more)
                more->set(i, image_of(rendering, options.drawing));
            doubts.skipped = std::max(doubts.skipped, renderer_->skipped_nonfinite());
            const bool seen = std::ranges::any_of(rendering.alpha.pixels, [](float a) { return a > 0; });
            if (splats_ > 0 && !seen && !doubts.unseen) doubts.unseen = i;
            check_signals();
        }
        return doubts;
    }

    RenderOptions options_;
    size_t splats_ = 0;
    OnDevice<Renderer> renderer_;
};

Renders render(const ObjectOrPath<Splats>& splats, nb::handle viewmats, nb::handle intrinsics, int width,
               int height, nb::handle background, const std::string& mode, const std::string& camera_model,
               nb::object distortion, const std::string& rolling_shutter, nb::object viewmats_end,
               std::optional<std::string> kernel, const std::string& integrator, std::optional<int> samples,
               bool points, std::optional<int> nearest, int sh_degree) {
    return SceneRenderer(*Opened<Splats>(splats, open_splats),
                         {std::move(kernel), integrator, samples, points, nearest, sh_degree})
        .render(viewmats, intrinsics, width, height, background, mode, camera_model, std::move(distortion),
                rolling_shutter, std::move(viewmats_end));
}

#define EWA_CAMERA_TYPES                                                                                \
    "viewmats: numpy.typing.ArrayLike, Ks: numpy.typing.ArrayLike | None, width: int, height: int, *, " \
    "background: numpy.typing.ArrayLike | str = (0, 0, 0), "                                            \
    "mode: typing.Literal['color', 'depth', 'median-depth', 'normal', 'count', 'ellipsoids'] = "        \
    "'color', " EWA_LENS_TYPES ", " EWA_READOUT_TYPES
#define EWA_SCENE_TYPES EWA_LOOK_TYPES ", sh_degree: int = 3"

constexpr const char* kRenderHelp =
    "Renders through cameras of the OpenCV convention. viewmats [C, 4, 4] map the world to the camera, Ks "
    "[C, 3, 3] are in "
    "pixels, with pixel centres at +0.5. One matrix [4, 4] gives arrays without the first dimension. mode "
    "\"depth\", \"median-depth\", \"normal\" and \"count\" "
    "add these arrays. camera_model is the lens of all cameras. distortion has OpenCV's terms: k1 k2 p1 p2 "
    "k3 k4 k5 k6 s1 s2 s3 "
    "s4 for \"opencv\", k1 k2 k3 k4 for \"fisheye\", or the first of these. An equirectangular image shows "
    "all directions "
    "with Ks None. Ks of an orthographic camera are px per world unit. "
    "With a rolling_shutter, viewmats are the poses when the readout leaves the first border of the image, "
    "and "
    "viewmats_end those when it reaches the opposite one. "
    "Without kernel, it is that of the splats. Ctrl-C ends it after "
    "a "
    "camera.";

}  // namespace

void bind_render(nb::module_& module) {
    using namespace nb::literals;
    nb::class_<Renders>(module, "Renders", "What render() returns.")
        .def_ro("color", &Renders::color,
                nb::for_getter(nb::sig("def color(self) -> numpy.typing.NDArray[numpy.float32]")),
                "[C, H, W, 3], with the background blended in, not clamped.")
        .def_ro("alpha", &Renders::alpha,
                nb::for_getter(nb::sig("def alpha(self) -> numpy.typing.NDArray[numpy.float32]")),
                "[C, H, W, 1], 0 where no splat is.")
        .def_ro("depth", &Renders::depth,
                nb::for_getter(nb::sig("def depth(self) -> numpy.typing.NDArray[numpy.float32] | None")),
                "[C, H, W, 1], the mean depth along the view's axis in world units, 0 where no splat is. For "
                "mode \"depth\".")
        .def_ro("count", &Renders::count,
                nb::for_getter(nb::sig("def count(self) -> numpy.typing.NDArray[numpy.float32] | None")),
                "[C, H, W, 1], the number of splats blended. For mode \"count\".")
        .def_ro(
            "median_depth", &Renders::median_depth,
            nb::for_getter(nb::sig("def median_depth(self) -> numpy.typing.NDArray[numpy.float32] | None")),
            "[C, H, W, 1], the depth of the surface along the view's axis in world units, 0 where no splat "
            "takes half of the light. For mode \"median-depth\".")
        .def_ro("normal", &Renders::normal,
                nb::for_getter(nb::sig("def normal(self) -> numpy.typing.NDArray[numpy.float32] | None")),
                "[C, H, W, 3], the normals of the surfaces in world axes towards the eye, of length 1; 0 "
                "where no "
                "splat is. For mode \"normal\".")
        .def("__repr__", renders_text)
        .def("_repr_png_", renders_png, nb::sig("def _repr_png_(self) -> bytes"),
             "The colours side by side, at most eight renders, for notebooks.")
        .def(
            "__getstate__",
            [](const Renders& r) {
                return nb::make_tuple(r.color, r.alpha, r.depth, r.count, r.median_depth, r.normal);
            },
            nb::sig("def __getstate__(self) -> tuple[object, ...]"))
        .def(
            "__setstate__",
            [](Renders& r, const nb::tuple& state) {
                if (state.size() != 6) throw nb::value_error("no state of Renders");
                new (&r) Renders{state[0], state[1], state[2], state[3], state[4], state[5]};
            },
            nb::sig("def __setstate__(self, state: tuple[object, ...], /) -> None"));
    nb::class_<SceneRenderer>(
        module, "Renderer", "A scene on the device, for more than one call of render(). Threads take turns.")
        .def(
            "__init__",
            [](SceneRenderer* self, const ObjectOrPath<Splats>& splats, std::optional<std::string> kernel,
               const std::string& integrator, std::optional<int> samples, bool points,
               std::optional<int> nearest, int sh_degree) {
                new (self)
                    SceneRenderer(*Opened<Splats>(splats, open_splats),
                                  {std::move(kernel), integrator, samples, points, nearest, sh_degree});
            },
            "splats"_a, nb::kw_only(), "kernel"_a = nb::none(), "integrator"_a = "splat",
            "samples"_a = nb::none(), "points"_a = false, "nearest"_a = nb::none(),
            "sh_degree"_a = kMaxShDegree,
            nb::sig("def __init__(self, splats: " EWA_SPLATS_TYPE ", *, " EWA_SCENE_TYPES ") -> None"),
            "Uploads a copy of the splats.")
        .def("replace", &SceneRenderer::replace, "splats"_a,
             nb::sig("def replace(self, splats: " EWA_SPLATS_TYPE ") -> None"),
             "Uploads other splats, with the kernels that there are.")
        .def("render", &SceneRenderer::render, "viewmats"_a, "Ks"_a.none(), "width"_a, "height"_a,
             nb::kw_only(), "background"_a = nb::make_tuple(0, 0, 0), "mode"_a = "color",
             "camera_model"_a = "pinhole", "distortion"_a = nb::none(), "rolling_shutter"_a = "global",
             "viewmats_end"_a = nb::none(), nb::sig("def render(self, " EWA_CAMERA_TYPES ") -> Renders"),
             kRenderHelp);
    module.def("render", render, "splats"_a, "viewmats"_a, "Ks"_a.none(), "width"_a, "height"_a,
               nb::kw_only(), "background"_a = nb::make_tuple(0, 0, 0), "mode"_a = "color",
               "camera_model"_a = "pinhole", "distortion"_a = nb::none(), "rolling_shutter"_a = "global",
               "viewmats_end"_a = nb::none(), "kernel"_a = nb::none(), "integrator"_a = "splat",
               "samples"_a = nb::none(), "points"_a = false, "nearest"_a = nb::none(),
               "sh_degree"_a = kMaxShDegree,
               nb::sig("def render(splats: " EWA_SPLATS_TYPE ", " EWA_CAMERA_TYPES ", " EWA_SCENE_TYPES
                       ") -> Renders"),
               kRenderHelp);
}

}  // namespace ewa::python
