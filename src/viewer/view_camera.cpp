// SPDX-License-Identifier: Apache-2.0
#include "viewer/view_camera.h"

#include <algorithm>
#include <cmath>
#include <glm/ext/matrix_transform.hpp>
#include <glm/geometric.hpp>
#include <glm/mat4x4.hpp>
#include <numbers>

namespace ewa::viewer {
namespace {

constexpr double kPoleMargin =
    std::numbers::pi / 90;         // least angle between view and `up` that orbiting reaches
constexpr double kClosest = 1e-3;  // distance to the pivot, in scene radii

glm::dmat3 rotation_about(const glm::dvec3& axis, double angle) {
    return glm::dmat3(glm::rotate(glm::dmat4(1.0), angle, axis));
}

/// Makes the rows orthonormal again. Otherwise rounding errors grow over thousands of small turns.
glm::dmat3 orthonormal(const glm::dmat3& rotation) {
    const glm::dmat3 rows = glm::transpose(rotation);
    const glm::dvec3 forward = glm::normalize(rows[2]);
    const glm::dvec3 right = glm::normalize(rows[0] - forward * glm::dot(forward, rows[0]));
    return glm::transpose(glm::dmat3(right, glm::cross(forward, right), forward));
}

}  // namespace

Camera fitted(const Camera& camera, int width, int height) {
    if (camera.width == width && camera.height == height) return camera;
    const double scale = std::min(double(width) / camera.width, double(height) / camera.height);
    Camera result = camera;
    result.width = width;
    result.height = height;
    result.fx *= scale;
    result.fy *= scale;
    result.cx = (camera.cx - camera.width / 2.0) * scale + width / 2.0;
    result.cy = (camera.cy - camera.height / 2.0) * scale + height / 2.0;
    return result;
}

glm::dvec3 ViewCamera::axis(int row) const {
    return {camera_.rotation[0][row], camera_.rotation[1][row], camera_.rotation[2][row]};
}

double ViewCamera::distance() const {
    return glm::length(pivot_ - camera_.position());
}

void ViewCamera::place(const glm::dmat3& rotation, const glm::dvec3& position) {
    camera_.rotation = rotation;
    camera_.translation = -(rotation * position);
}

void ViewCamera::turn(double yaw, double pitch, const glm::dvec3& center) {
    const glm::dvec3 forward = axis(2);
    const double angle = std::acos(std::clamp(glm::dot(forward, up_), -1.0, 1.0));
    // A view that starts closer to a pole than the margin may stay there but not come closer.
    const double lowest = std::min(kPoleMargin, angle);
    const double highest = std::max(std::numbers::pi - kPoleMargin, angle);
    pitch = angle - std::clamp(angle - pitch, lowest, highest);
    glm::dvec3 side = glm::cross(forward, up_);
    side = glm::length(side) > 1e-6 ? glm::normalize(side) : axis(0);

    const glm::dmat3 turned = rotation_about(up_, yaw) * rotation_about(side, pitch);
    const glm::dvec3 position = center + turned * (camera_.position() - center);
    pivot_ = center + turned * (pivot_ - center);
    place(orthonormal(camera_.rotation * glm::transpose(turned)), position);
}

void ViewCamera::orbit(double right, double down) {
    turn(-right, -down, pivot_);
}

void ViewCamera::look(double right, double down) {
    turn(right, down, camera_.position());
}

void ViewCamera::pan(double right, double down, int width, int height) {
    const Camera shown = camera(width, height);
    const glm::dvec3 moved =
        -(axis(0) * (right / shown.fx) + axis(1) * (down / shown.fy)) * std::max(distance(), 1e-9);
    pivot_ += moved;
    place(camera_.rotation, camera_.position() + moved);
}

void ViewCamera::zoom(double steps) {
    const double from = distance();
    const double to = std::max(from * std::pow(0.9, steps), kClosest * start_.radius);
    if (!(from > 0) || !std::isfinite(to)) return;
    place(camera_.rotation, pivot_ + (camera_.position() - pivot_) * (to / from));
}

void ViewCamera::fly(const glm::dvec3& amount) {
    const glm::dvec3 moved = (axis(0) * amount.x + axis(1) * amount.y + axis(2) * amount.z) * distance();
    pivot_ += moved;
    place(camera_.rotation, camera_.position() + moved);
}

void ViewCamera::focus(const glm::dvec3& point) {
    const glm::dvec3 position = camera_.position(), way = point - position;
    const double length = glm::length(way);
    if (!(length > 0) || !std::isfinite(length)) return;
    pivot_ = point;
    const glm::dvec3 forward = way / length;
    glm::dvec3 right = glm::cross(forward, up_);
    right = glm::length(right) > 1e-3 ? glm::normalize(right) : axis(0);
    place(orthonormal(glm::transpose(glm::dmat3(right, glm::cross(forward, right), forward))), position);
}

void ViewCamera::stand(const Viewpoint& place) {
    camera_ = place.camera;
    pivot_ = place.pivot;
    up_ = place.up;
}

void ViewCamera::reset() {
    stand(start_);
}

void ViewCamera::restart(const Viewpoint& start) {
    start_ = start;
    reset();
}

void ViewCamera::set_up(const glm::dvec3& up) {
    up_ = glm::normalize(up);
}

}  // namespace ewa::viewer
