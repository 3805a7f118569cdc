// SPDX-License-Identifier: Apache-2.0
#include "options.h"

#include <nanobind/stl/string.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <string>

#include "arrays.h"
#include "core/typing.h"
#include "core/words.h"
#include "ewa/error.h"
#include "ewa/sky_map.h"
#include "ewa/splat_edit.h"
#include "run/option_table.h"
#include "scene/looks.h"

namespace ewa::python {

std::array<float, 3> background_of(nb::handle value) {
    if (nb::isinstance<nb::str>(value)) {
        const std::string text = nb::borrow<nb::str>(value).c_str();
        const auto color = core::parse_colour(text);
        if (!color) throw InputError("background: " + core::not_a_colour(text));
        return *color;
    }
    const Array<float> array(value, "background", {3});
    if (!std::all_of(array.data(), array.data() + 3, [](float x) { return std::isfinite(x); }))
        throw InputError("background is not finite");
    return {array.data()[0], array.data()[1], array.data()[2]};
}

void use_background(RenderOptions& options, nb::handle value) {
    options.sky.reset();
    if (nb::isinstance<nb::str>(value) || nb::len(nb::getattr(value, "shape", nb::tuple())) != 3) {
        options.background = background_of(value);
        return;
    }
    const Array<float> array(value, "background", {Shape{3}, Shape{any('N'), any('N'), 3}});
    const size_t size = array.length(0);
    if (size == 0 || size > size_t(kMostSkyTexels) || array.length(1) != size)
        throw InputError("background: a sky is [n, n, 3], with n from 1 to " +
                         std::to_string(kMostSkyTexels));
    if (!std::all_of(array.data(), array.data() + array.size(), [](float x) { return std::isfinite(x); }))
        throw InputError("background is not finite");
    options.sky = std::make_shared<const SkyMap>(SkyMap{int(size), array.values()});
}

namespace {

int whole_number(const char* name, int value, int most) {
    if (value < 1 || value > most)
        throw InputError(std::string(name) + " is not from 1 to " + std::to_string(most));
    return value;
}

Footprint kernel_of(const LookArguments& arguments, const Splats& splats) {
    if (arguments.kernel) return asked_for("kernel", *arguments.kernel).train.render.kernel;
    if (arguments.points) return Footprint::peak;
    if (splats.gaussians.density) return Footprint::density;
    return splats.antialiased ? Footprint::antialias : Footprint::peak;
}

}  // namespace

std::string list_text(nb::handle value) {
    if (nb::isinstance<nb::str>(value)) return nb::cast<std::string>(value);
    std::string text;
    for (const nb::handle number : value)
        text.append(text.empty() ? "" : ",").append(nb::repr(nb::float_(nb::cast<double>(number))).c_str());
    return text;
}

RunOptions asked_for(const char* name, const std::string& text) {
    RunOptions options;
    of_argument(name, [&] { train::run_option(name).set(options, text); });
    return options;
}

RenderOptions look_of(const LookArguments& arguments, const Splats& splats) {
    RenderOptions look;
    look.kernel = kernel_of(arguments, splats);
    if (arguments.sh_degree < 0 || arguments.sh_degree > kMaxShDegree)
        throw InputError("sh_degree is not 0, 1, 2 or 3");
    look.sh_degree = arguments.sh_degree;
    look.integrator = of_argument(
        "integrator", [&] { return core::value_of(scene::kIntegratorWords, arguments.integrator); });
    look.points = arguments.points;
    scene::check_look(
        {.render = look, .nearest = arguments.nearest.has_value(), .samples = arguments.samples.has_value()});
    if (arguments.samples) look.samples = whole_number("samples", *arguments.samples, kMostSamples);
    if (arguments.nearest) look.nearest = whole_number("nearest", *arguments.nearest, kMostNearest);
    return look;
}

const Gaussians& fitted_to(Footprint kernel, const Splats& splats, Gaussians& fitted) {
    const bool density = kernel == Footprint::density;
    if (splats.gaussians.density == density) return splats.gaussians;
    fitted = splats.gaussians;
    fit_opacities(fitted, density);
    return fitted;
}

}  // namespace ewa::python
