// SPDX-License-Identifier: Apache-2.0
// The geometry of the tools: rays, handles, drags, strokes, and the matrices that they give. Independent of the window.
#pragma once
#include <array>
#include <glm/mat3x3.hpp>
#include <glm/mat4x4.hpp>
#include <glm/vec2.hpp>
#include <optional>
#include <string>
#include <vector>

#include "ewa/camera.h"

namespace ewa::viewer {

/// A ray in the world. direction: of unit length.
struct ToolRay {
    glm::dvec3 origin{0}, direction{0, 0, 1};
};
/// The ray of a position in the image, px. Empty where the lens shows nothing.
std::optional<ToolRay> ray_through(const Camera& camera, const glm::dvec2& pixel);
/// The unit vector from a point (world) to the viewer.
glm::dvec3 towards_viewer(const Camera& camera, const glm::dvec3& point);
/// The world units that a pixel shows across at a point, above zero.
double world_per_pixel(const Camera& camera, const glm::dvec3& point);

/// The place on an axis that is nearest to the ray, in world units from `origin`. axis: unit vector. Empty if both are nearly
/// parallel.
std::optional<double> along_axis(const ToolRay& ray, const glm::dvec3& origin, const glm::dvec3& axis);
/// Where the ray meets a plane. normal: unit vector. Empty if the ray is nearly in the plane, or leads away from it.
std::optional<glm::dvec3> on_plane(const ToolRay& ray, const glm::dvec3& point, const glm::dvec3& normal);
/// The angle from one vector to another about an axis (unit vector), radians from -pi to pi. Positive turns are right-handed.
double angle_about(const glm::dvec3& axis, const glm::dvec3& from, const glm::dvec3& to);
/// The rotation by an angle in radians about an axis of unit length, right-handed.
glm::dmat3 turn_about(const glm::dvec3& axis, double angle);

/// The largest of 1, 2 and 5 times a power of ten that is not above `size`. size > 0.
double nice_unit(double size);
/// The multiple of `step` that is nearest; the value itself if `step` is 0.
double snapped(double value, double step);

/// The matrix of a linear map about a centre.
glm::dmat4 about(const glm::dvec3& center, const glm::dmat3& linear);
/// The value of --transform: twelve numbers, row by row, with nine digits.
std::string matrix_text(const glm::dmat4& matrix);
/// "x,y,z" with nine digits.
std::string point_text(const glm::dvec3& point);

/// The matrix that makes the plane of three points level: y = 0, below the viewer's side (y points down). The middle of the points
/// keeps its x and z. viewer: from the plane to the viewer. Empty if the points are nearly on a line.
std::optional<glm::dmat4> level_matrix(const std::array<glm::dvec3, 3>& points, const glm::dvec3& viewer);
/// The camera that sees the transformed world as `camera` saw it before. matrix: rotation, translation and one scale.
Camera carried(const Camera& camera, const glm::dmat4& matrix);

double distance_to_segment(const glm::dvec2& point, const glm::dvec2& from, const glm::dvec2& to);
/// The distance to a line through all points; infinite without points.
double distance_to_line(const glm::dvec2& point, const std::vector<glm::dvec2>& line);
/// The same line with fewer points (Douglas and Peucker 1973). No dropped point was farther from it than `tolerance`.
std::vector<glm::dvec2> simplified(const std::vector<glm::dvec2>& line, double tolerance);

/// What a round brush covers, as rows of spans that do not overlap. step: the height of a row.
struct StrokeSpan {
    double y = 0, low = 0, high = 0;  // the row's middle; its span in x
};
std::vector<StrokeSpan> stroke_spans(const std::vector<glm::dvec2>& line, double radius, double step);

}  // namespace ewa::viewer
