// SPDX-License-Identifier: Apache-2.0
// Arguments that several functions take.
#pragma once
#include <nanobind/nanobind.h>

#include <array>

#include "ewa/render_options.h"

namespace ewa::python {

/// Three numbers, or a colour as core::parse_colour reads it. Throws InputError.
std::array<float, 3> background_of(nanobind::handle value);

inline Footprint footprint_of(bool antialias) {
    return antialias ? Footprint::antialias : Footprint::peak;
}

}  // namespace ewa::python
