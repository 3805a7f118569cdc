// SPDX-License-Identifier: Apache-2.0
// Arguments that several functions take.
#pragma once
#include <nanobind/nanobind.h>

#include <array>
#include <optional>
#include <string>

#include "bindings.h"
#include "ewa/error.h"
#include "ewa/render_options.h"
#include "ewa/run_options.h"

namespace ewa::python {

/// Three numbers, or a colour as core::parse_colour reads it. Throws InputError.
std::array<float, 3> background_of(nanobind::handle value);
/// Sets the background, or the sky if the value is an array [n, n, 3]. Throws InputError.
void use_background(RenderOptions& options, nanobind::handle value);

/// Calls a function, whose InputError then begins with the argument's name.
template <class Function>
auto of_argument(const char* name, const Function& function) {
    try {
        return function();
    } catch (const InputError& error) {
        throw InputError(std::string(name) + ": " + error.what());
    }
}

/// Numbers separated by commas, as the command line takes them. Text stays.
std::string list_text(nanobind::handle value);

/// The usual options with this one, which is named as on the command line. Throws InputError.
RunOptions asked_for(const char* name, const std::string& text);

/// How splats are rendered or evaluated, besides the background. Empty values are not given.
struct LookArguments {
    std::optional<std::string> kernel;
    std::string integrator = "splat";
    std::optional<int> samples;
    bool points = false;
    std::optional<int> nearest;
    int sh_degree = kMaxShDegree;
};

/// Throws InputError if a value is wrong, or values exclude each other.
RenderOptions look_of(const LookArguments& arguments, const Splats& splats);

/// The splats with opacities of the kernel. `fitted` holds them if they are not these already.
const Gaussians& fitted_to(Footprint kernel, const Splats& splats, Gaussians& fitted);

#define EWA_LOOK_TYPES                                                            \
    "kernel: typing.Literal['peak', 'antialias', 'density', 'ewa'] | None = "     \
    "None, "                                                                      \
    "integrator: typing.Literal['splat', 'ray', 'fast-ray', 'march'] = 'splat', " \
    "samples: int | None = None, "                                                \
    "points: bool = False, nearest: int | None = None"

}  // namespace ewa::python
