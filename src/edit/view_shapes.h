// SPDX-License-Identifier: Apache-2.0
// Shapes in the image of a view: polygons and brushes.
#pragma once
#include <functional>
#include <glm/vec2.hpp>
#include <string>
#include <vector>

#include "edit/edited_splats.h"
#include "ewa/camera.h"

namespace ewa::edit {

/// For each splat, whether the shape takes it. Splats that are not selectable are skipped by select().
using Shape = std::function<std::vector<bool>(const EditedSplats&)>;

/// Throws InputError: "what: 'text' is not form". A long text is cut off.
[[noreturn]] void refuse_shape(const std::string& what, const std::string& text, const std::string& form);

/// Parses polygon=... and brush=... of parse_selection() (edit/shapes.h). Throws InputError that begins with `what`.
Shape parse_view_shape(const std::string& text, const std::string& what);

/// The VIEW of a camera: a pinhole, or an orthographic lens as of the window. Other lenses give the pinhole with their focal length.
std::string view_text(const Camera& camera);

// What tools write: the text of a shape in the image of the camera, px.
std::string rectangle_shape(const Camera& camera, const glm::dvec2& from, const glm::dvec2& to);
std::string polygon_shape(const Camera& camera, const std::vector<glm::dvec2>& points);
std::string brush_shape(const Camera& camera, double radius, const std::vector<glm::dvec2>& points);
}  // namespace ewa::edit
