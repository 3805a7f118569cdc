// SPDX-License-Identifier: Apache-2.0
// Shapes in the image of a view: polygons and brushes.
#pragma once
#include <string>

#include "edit/shapes.h"

namespace ewa::edit {

/// Parses polygon=... and brush=... of parse_selection(). Throws InputError that begins with `what`.
Shape parse_view_shape(const std::string& text, const std::string& what);

}  // namespace ewa::edit
