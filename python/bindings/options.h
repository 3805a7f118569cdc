// SPDX-License-Identifier: Apache-2.0
// Arguments that several functions take.
#pragma once
#include <nanobind/nanobind.h>

#include <array>
#include <optional>

#include "bindings.h"
#include "ewa/error.h"
#include "ewa/render_options.h"

namespace ewa::python {

/// Three numbers, or a colour as core::parse_colour reads it. Throws InputError.
std::array<float, 3> background_of(nanobind::handle value);

inline Footprint footprint_of(bool antialias) {
    return antialias ? Footprint::antialias : Footprint::peak;
}

/// The kernel of a render or an evaluation. antialias: if given. Throws InputError for antialiased densities.
inline Footprint footprint_of(std::optional<bool> antialias, const Splats& splats) {
    if (!splats.gaussians.density) return footprint_of(antialias.value_or(splats.antialiased));
    if (antialias.value_or(false))
        throw InputError("antialias: splats of the density kernel have no such renders");
    return Footprint::density;
}

}  // namespace ewa::python
