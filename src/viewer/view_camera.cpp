// SPDX-License-Identifier: Apache-2.0
#include "viewer/view_camera.h"

#include <algorithm>
#include <cmath>
#include <glm/ext/matrix_transform.hpp>
#include <glm/geometric.hpp>
#include <glm/mat4x4.hpp>
#include <limits>
#include <numbers>
#include <vector>

#include "scene/readout.h"
#include "scene/statistics.h"

namespace ewa::viewer {
namespace {

constexpr double kPoleMargin =
    std::numbers::pi / 90;           // least angle between view and `up` that orbiting reaches
constexpr double kClosest = 1e-3;    // distance to the pivot, in scene radii
constexpr size_t kSamples = 200000;  // of the means; more do not change the percentiles visibly

/// The camera's x, y or z axis in world coordinates.
glm::dvec3 axis_of(const Camera& camera, int row) {
    return {camera.rotation[0][row], camera.rotation[1][row], camera.rotation[2][row]};
}

/// The rotation of a camera with these axes in world coordinates, which are unit vectors.
glm::dmat3 facing(const glm::dvec3& forward, const glm::dvec3& right) {
    return glm::transpose(glm::dmat3(right, glm::cross(forward, right), forward));
}

glm::dmat3 rotation_about(const glm::dvec3& axis, double angle) {
    return glm::dmat3(glm::rotate(glm::dmat4(1.0), angle, axis));
}

/// Makes the rows orthonormal again. Otherwise rounding errors grow over thousands of small turns.
glm::dmat3 orthonormal(const glm::dmat3& rotation) {
    const glm::dmat3 rows = glm::transpose(rotation);
    const glm::dvec3 forward = glm::normalize(rows[2]);
    return facing(forward, glm::normalize(rows[0] - forward * glm::dot(forward, rows[0])));
}

std::vector<glm::dvec3> sampled_means(const Gaussians& gaussians, float least_logit) {
    std::vector<glm::dvec3> means;
    const size_t stride = std::max<size_t>(1, gaussians.size() / kSamples);
    for (size_t i = 0; i < gaussians.size(); i += stride) {
        const glm::dvec3 mean = gaussians.world_mean(i);
        if (!(gaussians.opacity_logits[i] >= least_logit)) continue;
        if (std::isfinite(mean[0]) && std::isfinite(mean[1]) && std::isfinite(mean[2])) means.push_back(mean);
    }
    return means;
}

/// The median view z of the splats in the middle third of the image that are at least half opaque; 0 if there
/// are too few.
double middle_depth(const Gaussians& gaussians, const Camera& camera) {
    std::vector<double> depths;
    for (const glm::dvec3& mean : sampled_means(gaussians, 0.0f)) {
        const glm::dvec3 p = camera.rotation * mean + camera.translation;
        if (!(p.z > 0)) continue;
        const double x = camera.fx * p.x / p.z + camera.cx, y = camera.fy * p.y / p.z + camera.cy;
        if (std::abs(x - camera.width / 2.0) < camera.width / 6.0 &&
            std::abs(y - camera.height / 2.0) < camera.height / 6.0)
            depths.push_back(p.z);
    }
    return depths.size() < 10 ? 0 : scene::quantile(depths, 0.5);
}

}  // namespace

double ViewCamera::distance() const {
    return glm::length(now_.pivot - now_.camera.position());
}

void ViewCamera::place(const glm::dmat3& rotation, const glm::dvec3& position) {
    now_.camera.rotation = rotation;
    now_.camera.translation = -(rotation * position);
}

void ViewCamera::turn(double yaw, double pitch, const glm::dvec3& center) {
    const glm::dvec3 forward = axis_of(now_.camera, 2);
    const double angle = std::acos(std::clamp(glm::dot(forward, now_.up), -1.0, 1.0));
    // A view that starts closer to a pole than the margin may stay there but not come closer.
    const double lowest = std::min(kPoleMargin, angle);
    const double highest = std::max(std::numbers::pi - kPoleMargin, angle);
    pitch = angle - std::clamp(angle - pitch, lowest, highest);
    glm::dvec3 side = glm::cross(forward, now_.up);
    side = glm::length(side) > 1e-6 ? glm::normalize(side) : axis_of(now_.camera, 0);

    const glm::dmat3 turned = rotation_about(now_.up, yaw) * rotation_about(side, pitch);
    const glm::dvec3 position = center + turned * (now_.camera.position() - center);
    now_.pivot = center + turned * (now_.pivot - center);
    place(orthonormal(now_.camera.rotation * glm::transpose(turned)), position);
}

void ViewCamera::orbit(double right, double down) {
    turn(-right, -down, now_.pivot);
}

void ViewCamera::look(double right, double down) {
    turn(right, down, now_.camera.position());
}

void ViewCamera::pan(double right, double down, int width, int height) {
    const Camera shown = camera(width, height);
    const glm::dvec3 moved =
        -(axis_of(now_.camera, 0) * (right / shown.fx) + axis_of(now_.camera, 1) * (down / shown.fy)) *
        std::max(distance(), 1e-9);
    now_.pivot += moved;
    place(now_.camera.rotation, now_.camera.position() + moved);
}

void ViewCamera::zoom(double steps) {
    const double from = distance();
    const double to = std::max(from * std::pow(0.9, steps), kClosest * start_.radius);
    if (!(from > 0) || !std::isfinite(to)) return;
    place(now_.camera.rotation, now_.pivot + (now_.camera.position() - now_.pivot) * (to / from));
}

void ViewCamera::fly(const glm::dvec3& amount) {
    const glm::dvec3 moved = (axis_of(now_.camera, 0) * amount.x + axis_of(now_.camera, 1) * amount.y +
                              axis_of(now_.camera, 2) * amount.z) *
                             distance();
    now_.pivot += moved;
    place(now_.camera.rotation, now_.camera.position() + moved);
}

void ViewCamera::focus(const glm::dvec3& point) {
    const glm::dvec3 position = now_.camera.position(), way = point - position;
    const double length = glm::length(way);
    if (!(length > 0) || !std::isfinite(length)) return;
    now_.pivot = point;
    const glm::dvec3 forward = way / length;
    glm::dvec3 right = glm::cross(forward, now_.up);
    right = glm::length(right) > 1e-3 ? glm::normalize(right) : axis_of(now_.camera, 0);
    place(orthonormal(facing(forward, right)), position);
}

SceneBounds scene_bounds(const Gaussians& gaussians) {
    const std::vector<glm::dvec3> means = sampled_means(gaussians, -std::numeric_limits<float>::infinity());
    SceneBounds bounds;
    if (means.empty()) return bounds;
    glm::dvec3 low(0), high(0);
    std::vector<double> values(means.size());
    for (int axis = 0; axis < 3; ++axis) {
        for (size_t i = 0; i < means.size(); ++i) values[i] = means[i][axis];
        low[axis] = scene::quantile(values, 0.05);
        high[axis] = scene::quantile(values, 0.95);
    }
    bounds.center = (low + high) / 2.0;
    const double radius = glm::length(high - low) / 2.0;
    if (radius > 0 && std::isfinite(radius)) bounds.radius = radius;
    return bounds;
}

Viewpoint framing_view(const Gaussians& gaussians, const Dataset* dataset, int width, int height) {
    scene::FramingHints hints;
    if (dataset && !dataset->frames.empty()) {
        hints.up = scene::mean_up(*dataset);
        hints.forward = axis_of(dataset->frames.front().camera, 2);
    }
    const scene::Framing framing = scene::frame_scene(gaussians, width, height, hints);
    return {framing.camera, framing.target, framing.up, framing.radius};
}

int nearest_frame(const Dataset& dataset, const Camera& camera, double radius) {
    int nearest = -1;
    double least = std::numeric_limits<double>::infinity();
    for (size_t i = 0; i < dataset.frames.size(); ++i) {
        const Camera& other = dataset.frames[i].camera;
        const double turn = 1 - glm::dot(axis_of(camera, 2), axis_of(other, 2));
        const double distance = glm::length(camera.position() - other.position()) + radius * turn;
        if (!(distance < least)) continue;
        least = distance;
        nearest = int(i);
    }
    return nearest;
}

double camera_size(const Dataset& dataset, double radius) {
    std::vector<double> steps;
    for (size_t i = 1; i < dataset.frames.size(); ++i)
        steps.push_back(
            glm::length(dataset.frames[i].camera.position() - dataset.frames[i - 1].camera.position()));
    const double step = scene::quantile(steps, 0.5);
    return step > 0 && std::isfinite(step) ? 0.3 * step : 0.05 * radius;
}

Viewpoint dataset_view(const Gaussians& gaussians, const Dataset& dataset, int frame) {
    const SceneBounds bounds = scene_bounds(gaussians);
    Viewpoint view;
    view.camera = scene::at_middle(dataset.frames.at(size_t(frame)).camera);
    view.up = scene::mean_up(dataset);
    view.radius = bounds.radius;
    const glm::dvec3 forward = axis_of(view.camera, 2), position = view.camera.position();
    double depth = middle_depth(gaussians, view.camera);
    if (!(depth > 0)) depth = glm::dot(bounds.center - position, forward);
    if (!(depth > 0)) depth = bounds.radius;
    view.pivot = position + forward * depth;
    return view;
}

}  // namespace ewa::viewer
