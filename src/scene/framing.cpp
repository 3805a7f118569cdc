// SPDX-License-Identifier: Apache-2.0
#include "scene/framing.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/ext/matrix_transform.hpp>
#include <glm/ext/quaternion_double.hpp>
#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>
#include <glm/mat4x4.hpp>
#include <limits>
#include <numbers>
#include <vector>

#include "scene/statistics.h"

namespace ewa::scene {
namespace {

constexpr size_t kMostSamples = 200000;                          // more do not change the percentiles visibly
constexpr float kFaintLogit = -2.2f;                             // of opacity 0.1
constexpr double kFieldOfView = 50 * std::numbers::pi / 180;     // of the shorter side
constexpr double kElevation = 0.25;                              // how far the view goes down for its length
constexpr double kMargin = 1.07;                                 // of the image around the scene
constexpr double kFence = 0.6, kMostFloaters = 0.03;             // of framed_box
constexpr double kVeil = 100;                                    // of the scene's size
constexpr double kTail = 0.002;                                  // share of splats that the box may cut
constexpr double kSlab = 0.08, kCovered = 0.5, kClearer = 0.25;  // of guessed_up
constexpr double kBroader = 1.2;  // of towards_broad_side, in standard deviations
constexpr int kCells = 16;        // of a face's grid, along each axis

/// A splat's mean, its standard deviations along the world's axes, and how much of an image it covers: opacity times the
/// area of its largest face.
struct Extent {
    glm::dvec3 mean{0}, deviation{0};
    double weight = 0;
};

bool finite(const glm::dvec3& v) {
    return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z);
}

Extent extent_of(const Gaussians& gaussians, size_t i) {
    const float* q = &gaussians.quaternions[4 * i];
    const double norm =
        std::sqrt(double(q[0]) * q[0] + double(q[1]) * q[1] + double(q[2]) * q[2] + double(q[3]) * q[3]);
    const glm::dmat3 axes = glm::mat3_cast(glm::dquat(q[0] / norm, q[1] / norm, q[2] / norm, q[3] / norm));
    Extent extent{gaussians.world_mean(i), {}};
    std::array<double, 3> scales{};
    for (int k = 0; k < 3; ++k) {
        scales[size_t(k)] = std::exp(double(gaussians.log_scales[3 * i + size_t(k)]));
        extent.deviation += scales[size_t(k)] * scales[size_t(k)] * axes[k] * axes[k];
    }
    extent.deviation = glm::sqrt(extent.deviation);
    std::ranges::sort(scales);
    extent.weight = scales[1] * scales[2] / (1 + std::exp(-double(gaussians.opacity_logits[i])));
    return extent;
}

std::vector<Extent> sampled(const Gaussians& gaussians, float least_logit) {
    std::vector<Extent> extents;
    const size_t stride = std::max<size_t>(1, gaussians.size() / kMostSamples);
    for (size_t i = 0; i < gaussians.size(); i += stride) {
        if (!(gaussians.opacity_logits[i] >= least_logit)) continue;
        const Extent extent = extent_of(gaussians, i);
        if (finite(extent.mean) && finite(extent.deviation)) extents.push_back(extent);
    }
    return extents;
}

double largest(const glm::dvec3& v) {
    return std::max({v.x, v.y, v.z});
}

/// Removes splats that are far larger than the scene: the camera would be so far away that nothing else shows.
void remove_veils(std::vector<Extent>& extents) {
    if (extents.empty()) return;
    std::vector<double> sizes, places;
    for (const Extent& extent : extents) sizes.push_back(largest(extent.deviation));
    double most = quantile(sizes, 0.5);
    for (int axis = 0; axis < 3; ++axis) {
        places.clear();
        for (const Extent& extent : extents) places.push_back(extent.mean[axis]);
        most = std::max(most, quantile(places, 0.95) - quantile(places, 0.05));
    }
    std::erase_if(extents, [&](const Extent& extent) { return largest(extent.deviation) > kVeil * most; });
}

std::vector<Extent> sampled(const Gaussians& gaussians) {
    std::vector<Extent> extents = sampled(gaussians, kFaintLogit);
    if (extents.empty()) extents = sampled(gaussians, -std::numeric_limits<float>::infinity());
    remove_veils(extents);
    return extents;
}

/// The ends of framed_box on one axis.
std::array<double, 2> ends(const std::vector<Extent>& extents, int axis) {
    std::vector<double> values(extents.size());
    for (size_t i = 0; i < values.size(); ++i) values[i] = extents[i].mean[axis];
    const double low = quantile(values, 0.05), high = quantile(values, 0.95);
    const double reach = kFence * (high - low);
    std::vector<double> lows, highs;
    for (const Extent& extent : extents) {
        if (extent.mean[axis] < low - reach || extent.mean[axis] > high + reach) continue;
        lows.push_back(extent.mean[axis] - extent.deviation[axis]);
        highs.push_back(extent.mean[axis] + extent.deviation[axis]);
    }
    const double floaters = 1 - double(lows.size()) / double(extents.size());
    if (floaters > kMostFloaters && high > low) return {low, high};
    return {quantile(lows, kTail), quantile(highs, 1 - kTail)};
}

Box box_of(const std::vector<Extent>& extents) {
    Box box;
    if (extents.empty()) return box;
    for (int axis = 0; axis < 3; ++axis) {
        const auto [low, high] = ends(extents, axis);
        box.low[axis] = low;
        box.high[axis] = high;
    }
    return box;
}

bool inside(const Box& box, const glm::dvec3& point) {
    for (int axis = 0; axis < 3; ++axis)
        if (!(point[axis] >= box.low[axis] && point[axis] <= box.high[axis])) return false;
    return true;
}

/// The share of a face's cells with a splat within kSlab of it. at_high: the face at high values of the axis.
double coverage(const std::vector<Extent>& extents, const Box& box, int axis, bool at_high) {
    std::array<bool, size_t(kCells) * kCells> covered{};
    const glm::dvec3 size = box.high - box.low;
    for (const Extent& extent : extents) {
        if (!inside(box, extent.mean)) continue;
        const glm::dvec3 place = (extent.mean - box.low) / size;
        if ((at_high ? 1 - place[axis] : place[axis]) > kSlab) continue;
        const auto cell = [&](int other) {
            return size_t(std::clamp(int(place[other] * kCells), 0, kCells - 1));
        };
        covered[cell((axis + 1) % 3) * kCells + cell((axis + 2) % 3)] = true;
    }
    return double(std::count(covered.begin(), covered.end(), true)) / double(covered.size());
}

glm::dvec3 guessed_up(const std::vector<Extent>& extents, const Box& box) {
    const glm::dvec3 usual(0, -1, 0), size = box.high - box.low;
    if (extents.empty() || !(std::min({size.x, size.y, size.z}) > 0)) return usual;
    const auto ground = [&](int axis, bool at_high) {
        const double here = coverage(extents, box, axis, at_high);
        return here > kCovered ? here - coverage(extents, box, axis, !at_high) : 0.0;
    };
    const double down_y = ground(1, true), down_z = ground(2, false), up_y = ground(1, false);
    if (std::max(down_z, up_y) < std::max(0.0, down_y) + kClearer) return usual;
    return down_z >= up_y ? glm::dvec3(0, 0, 1) : glm::dvec3(0, 1, 0);
}

/// The horizontal direction of a view of the front: +z where y points down, as in COLMAP's cameras; +y where z
/// points up, as in Blender; -z where y points up, as in glTF.
glm::dvec3 usual_forward(const glm::dvec3& up) {
    if (std::abs(up.z) > 0.8) return {0, 1, 0};
    return up.y > 0.8 ? glm::dvec3(0, 0, -1) : glm::dvec3(0, 0, 1);
}

/// The part of a direction at a right angle to `up`, unit length; empty if there is none.
std::optional<glm::dvec3> horizontal(const glm::dvec3& direction, const glm::dvec3& up) {
    const glm::dvec3 level = direction - up * glm::dot(direction, up);
    const double length = glm::length(level);
    if (!(length > 1e-6 * glm::length(direction)) || !std::isfinite(length)) return std::nullopt;
    return level / length;
}

/// The horizontal direction in which the scene is thinnest, on the side of `usual`. From there it is seen at its
/// broadest. It is `usual` itself for a scene that is about as deep as broad.
glm::dvec3 towards_broad_side(const std::vector<Extent>& extents, const Box& box, const glm::dvec3& up,
                              const glm::dvec3& usual) {
    const glm::dvec3 right = glm::cross(usual, up);
    double sum = 0;
    glm::dvec2 mean(0), squares(0);
    double product = 0;
    for (const Extent& extent : extents) {
        if (!inside(box, extent.mean) || !std::isfinite(extent.weight)) continue;
        const glm::dvec3 from_center = extent.mean - box.center();
        const glm::dvec2 p(glm::dot(from_center, right), glm::dot(from_center, usual));
        sum += extent.weight;
        mean += extent.weight * p;
        squares += extent.weight * p * p;
        product += extent.weight * p.x * p.y;
    }
    if (!(sum > 0)) return usual;
    mean /= sum;
    const glm::dvec2 variance = squares / sum - mean * mean;
    const double covariance = product / sum - mean.x * mean.y;
    const double middle = (variance.x + variance.y) / 2,
                 half = std::hypot((variance.x - variance.y) / 2, covariance);
    if (!(middle + half > kBroader * kBroader * (middle - half))) return usual;
    const double angle =
        std::atan2(2 * covariance, variance.x - variance.y) / 2;  // of the broad axis, from `right`
    const glm::dvec3 thin = usual * std::cos(angle) - right * std::sin(angle);
    return glm::dot(thin, usual) < 0 ? -thin : thin;
}

glm::dmat3 facing(const glm::dvec3& forward, const glm::dvec3& up) {
    const glm::dvec3 other = std::abs(forward.z) < 0.9 ? glm::dvec3(0, 0, 1) : glm::dvec3(0, 1, 0);
    const glm::dvec3 level_up = horizontal(up, forward).value_or(*horizontal(other, forward));
    return glm::transpose(glm::dmat3(glm::cross(forward, level_up), -level_up, forward));
}

Camera camera_of_size(int width, int height) {
    Camera camera;
    camera.width = width;
    camera.height = height;
    camera.fx = camera.fy = std::min(width, height) / 2.0 / std::tan(kFieldOfView / 2);
    camera.cx = width / 2.0;
    camera.cy = height / 2.0;
    return camera;
}

/// How far from `target` a camera of this rotation must be for all splats of the box to be in the image.
double distance_to_fit(const std::vector<Extent>& extents, const Box& box, const Camera& camera,
                       const glm::dvec3& target) {
    const glm::dvec2 half(camera.width / 2.0 / camera.fx / kMargin,
                          camera.height / 2.0 / camera.fy / kMargin);
    double distance = 0;
    for (const Extent& extent : extents) {
        if (!inside(box, extent.mean)) continue;
        // The splat's own size, but no more than the box: a splat may be larger than the scene.
        const glm::dvec3 low = glm::max(extent.mean - extent.deviation, box.low) - target;
        const glm::dvec3 high = glm::min(extent.mean + extent.deviation, box.high) - target;
        for (int corner = 0; corner < 8; ++corner) {
            const glm::dvec3 p =
                camera.rotation * glm::dvec3(corner & 1 ? high.x : low.x, corner & 2 ? high.y : low.y,
                                             corner & 4 ? high.z : low.z);
            distance = std::max({distance, std::abs(p.x) / half.x - p.z, std::abs(p.y) / half.y - p.z});
        }
    }
    return distance;
}

}  // namespace

Box framed_box(const Gaussians& gaussians) {
    return box_of(sampled(gaussians));
}

glm::dvec3 guessed_up(const Gaussians& gaussians) {
    const std::vector<Extent> extents = sampled(gaussians);
    return guessed_up(extents, box_of(extents));
}

glm::dvec3 mean_up(const Dataset& dataset) {
    glm::dvec3 sum(0);
    for (const Frame& frame : dataset.frames) {
        const glm::dmat3& rotation = frame.camera.rotation;
        sum -= glm::dvec3(rotation[0][1], rotation[1][1], rotation[2][1]);
    }
    if (!(glm::length(sum) > 0.1 * double(dataset.frames.size()))) return {0, -1, 0};
    return glm::normalize(sum);
}

Framing frame_scene(const Gaussians& gaussians, int width, int height, const FramingHints& hints) {
    const std::vector<Extent> extents = sampled(gaussians);
    const Box box = box_of(extents);
    Framing framing;
    framing.up = hints.up ? glm::normalize(*hints.up) : guessed_up(extents, box);
    if (!extents.empty()) framing.target = box.center();
    const double radius = extents.empty() ? 0 : glm::length(box.high - box.low) / 2;
    if (radius > 0 && std::isfinite(radius)) framing.radius = radius;

    const glm::dvec3 front = usual_forward(framing.up);
    const glm::dvec3 usual = horizontal(front, framing.up).value_or(glm::dvec3(1, 0, 0));
    const std::optional<glm::dvec3> known =
        hints.forward ? horizontal(*hints.forward, framing.up) : std::nullopt;
    const glm::dvec3 level = known.value_or(towards_broad_side(extents, box, framing.up, usual));
    const glm::dvec3 forward = glm::normalize(level - kElevation * framing.up);
    constexpr int kDirections = 24;
    Camera& camera = framing.camera;
    double distance = 0;
    for (int i = 0; i < (hints.all_round ? kDirections : 1); ++i) {
        const glm::dmat4 turn =
            glm::rotate(glm::dmat4(1), 2 * std::numbers::pi * i / kDirections, framing.up);
        camera =
            look_at(framing.target - glm::dmat3(turn) * forward, framing.target, framing.up, width, height);
        distance = std::max(distance, distance_to_fit(extents, box, camera, framing.target));
    }
    if (!(distance > 0) || !std::isfinite(distance)) distance = framing.radius / std::sin(kFieldOfView / 2);
    camera = look_at(framing.target - forward * distance, framing.target, framing.up, width, height);
    return framing;
}

Camera look_at(const glm::dvec3& eye, const glm::dvec3& target, const glm::dvec3& up, int width, int height) {
    Camera camera = camera_of_size(width, height);
    camera.rotation = facing(glm::normalize(target - eye), up);
    camera.translation = -(camera.rotation * eye);
    return camera;
}

Camera pinhole_at(const Camera& camera) {
    if (camera.distortion.none()) return camera;
    Camera pinhole = camera_of_size(camera.width, camera.height);
    pinhole.rotation = camera.rotation;
    pinhole.translation = camera.translation;
    return pinhole;
}

Camera orbited(const Camera& camera, const glm::dvec3& target, const glm::dvec3& up, double angle) {
    const glm::dmat3 turn(glm::rotate(glm::dmat4(1), angle, up));
    const glm::dvec3 position = target + turn * (camera.position() - target);
    Camera result = camera;
    result.readout.reset();
    result.rotation = camera.rotation * glm::transpose(turn);
    result.translation = -(result.rotation * position);
    return result;
}

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

}  // namespace ewa::scene
