// SPDX-License-Identifier: Apache-2.0
#include "viewer/framing.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <limits>
#include <numbers>
#include <vector>

namespace ewa::viewer {
namespace {

constexpr size_t kSamples = 200000;  // of the means; more do not change the percentiles visibly

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

/// Reorders the values. There must be at least one.
double quantile(std::vector<double>& values, double share) {
    const auto at = values.begin() + std::ptrdiff_t(share * double(values.size() - 1));
    std::nth_element(values.begin(), at, values.end());
    return *at;
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
    return depths.size() < 10 ? 0 : quantile(depths, 0.5);
}

glm::dvec3 forward_of(const Camera& camera) {
    return {camera.rotation[0][2], camera.rotation[1][2], camera.rotation[2][2]};
}

glm::dvec3 mean_up(const Dataset& dataset) {
    glm::dvec3 sum(0);
    for (const Frame& frame : dataset.frames) {
        const glm::dmat3& r = frame.camera.rotation;
        sum -= glm::dvec3(r[0][1], r[1][1], r[2][1]);
    }
    // Cameras with all orientations have no common up.
    if (!(glm::length(sum) > 0.1 * double(dataset.frames.size()))) return {0, -1, 0};
    return glm::normalize(sum);
}

}  // namespace

SceneBounds scene_bounds(const Gaussians& gaussians) {
    const std::vector<glm::dvec3> means = sampled_means(gaussians, -std::numeric_limits<float>::infinity());
    SceneBounds bounds;
    if (means.empty()) return bounds;
    glm::dvec3 low(0), high(0);
    std::vector<double> values(means.size());
    for (int axis = 0; axis < 3; ++axis) {
        for (size_t i = 0; i < means.size(); ++i) values[i] = means[i][axis];
        low[axis] = quantile(values, 0.05);
        high[axis] = quantile(values, 0.95);
    }
    bounds.center = (low + high) / 2.0;
    const double radius = glm::length(high - low) / 2.0;
    if (radius > 0 && std::isfinite(radius)) bounds.radius = radius;
    return bounds;
}

Viewpoint framing_view(const Gaussians& gaussians, int width, int height) {
    const SceneBounds bounds = scene_bounds(gaussians);
    constexpr double kFieldOfView = 50 * std::numbers::pi / 180;  // of the shorter side
    Viewpoint view;
    view.radius = bounds.radius;
    view.pivot = bounds.center;

    const glm::dvec3 forward = glm::normalize(glm::dvec3(0, 0.25, 1));
    const glm::dvec3 right(1, 0, 0);
    Camera& camera = view.camera;
    camera.width = width;
    camera.height = height;
    camera.fx = camera.fy = std::min(width, height) / 2.0 / std::tan(kFieldOfView / 2);
    camera.cx = width / 2.0;
    camera.cy = height / 2.0;
    camera.rotation = glm::transpose(glm::dmat3(right, glm::cross(forward, right), forward));
    const glm::dvec3 position = bounds.center - forward * (bounds.radius / std::sin(kFieldOfView / 2));
    camera.translation = -(camera.rotation * position);
    return view;
}

int nearest_frame(const Dataset& dataset, const Camera& camera, double radius) {
    int nearest = -1;
    double least = std::numeric_limits<double>::infinity();
    for (size_t i = 0; i < dataset.frames.size(); ++i) {
        const Camera& other = dataset.frames[i].camera;
        const double turn = 1 - glm::dot(forward_of(camera), forward_of(other));
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
    const double step = steps.empty() ? 0 : quantile(steps, 0.5);
    return step > 0 && std::isfinite(step) ? 0.3 * step : 0.05 * radius;
}

Viewpoint dataset_view(const Gaussians& gaussians, const Dataset& dataset, int frame) {
    const SceneBounds bounds = scene_bounds(gaussians);
    Viewpoint view;
    view.camera = dataset.frames.at(size_t(frame)).camera;
    view.up = mean_up(dataset);
    view.radius = bounds.radius;
    const glm::dvec3 forward = forward_of(view.camera), position = view.camera.position();
    double depth = middle_depth(gaussians, view.camera);
    if (!(depth > 0)) depth = glm::dot(bounds.center - position, forward);
    if (!(depth > 0)) depth = bounds.radius;
    view.pivot = position + forward * depth;
    return view;
}

}  // namespace ewa::viewer
