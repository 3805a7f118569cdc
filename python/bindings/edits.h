// SPDX-License-Identifier: Apache-2.0
// The methods of ewa.Splats that clean, thin and move a scene: the options of ewa convert.
#pragma once
#include <nanobind/nanobind.h>

#include <glm/mat4x4.hpp>

#include "bindings.h"

namespace ewa::python {

/// steps: each a text that edit::parse_transform reads, or a matrix [3, 4] or [4, 4]. Throws ValueError, InputError.
glm::dmat4 matrix_of_steps(nanobind::handle steps);

void bind_edits(nanobind::class_<Splats>& splats);

}  // namespace ewa::python
