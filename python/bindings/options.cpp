// SPDX-License-Identifier: Apache-2.0
#include "options.h"

#include <algorithm>
#include <cmath>

#include "arrays.h"
#include "core/typing.h"
#include "core/words.h"
#include "ewa/error.h"
#include "ewa/splat_edit.h"
#include "pipeline/plan.h"
#include "run/run_options.h"

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

namespace {

Integrator integrator_of(const std::string& word) {
    static const core::Words<Integrator> words{
        {"splat", Integrator::splat}, {"ray", Integrator::ray}, {"march", Integrator::march}};
    return of_argument("integrator", [&] { return core::value_of(words, word); });
}

int whole_number(const char* name, int value, int most) {
    if (value < 1 || value > most)
        throw InputError(std::string(name) + " is not from 1 to " + std::to_string(most));
    return value;
}

Footprint kernel_of(const LookArguments& arguments, const Splats& splats) {
    if (arguments.kernel && arguments.antialias) throw InputError("antialias and kernel exclude each other");
    if (arguments.kernel) return asked_for("kernel", *arguments.kernel).train.render.kernel;
    if (arguments.points) return footprint_of(arguments.antialias.value_or(false));
    if (!splats.gaussians.density) return footprint_of(arguments.antialias.value_or(splats.antialiased));
    if (arguments.antialias.value_or(false))
        throw InputError("antialias: splats of the density kernel have no such renders");
    return Footprint::density;
}

}  // namespace

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
    look.integrator = integrator_of(arguments.integrator);
    look.points = arguments.points;
    pipeline::check_points(look);
    if (look.integrator != Integrator::splat && look.kernel == Footprint::antialias)
        throw InputError("integrator: there are no footprints to antialias; kernel=\"peak\" has none");
    if (arguments.samples && look.integrator != Integrator::march)
        throw InputError("samples: only integrator=\"march\" takes samples of a ray");
    if (arguments.nearest && !look.points) throw InputError("nearest is an argument of points=True");
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
