// SPDX-License-Identifier: Apache-2.0
#include "capture/lens_check.h"

#include <algorithm>
#include <cmath>
#include <tuple>

#include "core/text.h"
#include "scene/lens.h"

namespace ewa::capture {
namespace {

constexpr double kShortest = 0.3, kLongest = 5;  // focal lengths, by the longer side
constexpr double kFarFromExif = 0.4;             // part of EXIF's focal length
constexpr double kApart = 0.01;                  // fx and fy, of which pixels are squares
constexpr double kTangential = 0.01;             // terms of lenses that are out of line by more than any
constexpr double kNearCorner = 0.9;   // of the way there; one term may fold where hardly any points are
constexpr double kMostOutward = 1.2;  // times the distance from the middle
constexpr int kRadii = 32;            // at which the distortion is looked at
constexpr double kInFront = 0.9;      // of a photo's points
constexpr double kEnough = 0.8;       // of the photos

std::string px(double value) {
    return std::to_string(std::lround(value)) + " px";
}

/// Whether the lens shows each direction up to near the corner once, and stretches it by no more than lenses do.
bool keeps_order(const Camera& lens) {
    const glm::dvec2 corner(std::max(lens.cx, lens.width - lens.cx) / lens.fx,
                            std::max(lens.cy, lens.height - lens.cy) / lens.fy);
    double before = 0;
    const double reach = kNearCorner * glm::length(corner);
    for (int i = 1; i <= 4 * kRadii; ++i) {
        const glm::dvec2 ray = corner * (double(i) / kRadii);
        const double radius = glm::length(scene::distort(lens.distortion, ray));
        if (!std::isfinite(radius) || radius <= before || !scene::one_to_one(lens.distortion, ray))
            return false;
        if (radius > kMostOutward * glm::length(ray)) return false;
        if (radius >= reach) return true;
        before = radius;
    }
    return true;
}

/// Whether nearly all points that the photo shows are in front of it.
bool looks_at_its_points(const SparseModel& model, const SparseImage& image) {
    const Camera camera = camera_of(model, image);
    size_t all = 0, front = 0;
    for (const SparseFeature& feature : image.features) {
        const auto point = model.points.find(feature.point);
        if (feature.point == kNoPoint || point == model.points.end()) continue;
        ++all;
        if ((camera.rotation * point->second.position + camera.translation).z > 0) ++front;
    }
    return double(front) >= kInFront * double(all);
}

}  // namespace

std::string lens_fault(const Camera& lens, double expected) {
    const double side = std::max(lens.width, lens.height), focal = 0.5 * (lens.fx + lens.fy);
    if (lens.distortion.lens == Lens::equirectangular) return {};
    if (std::abs(lens.fx - lens.fy) > kApart * focal)
        return "the focal lengths are " + px(lens.fx) + " along and " + px(lens.fy) + " across";
    if (focal < kShortest * side || focal > kLongest * side)
        return "the focal length of " + px(focal) + " is no camera's";
    if (expected > 0 && std::abs(focal - expected) > kFarFromExif * expected)
        return "the focal length is " + px(focal) + ", and EXIF has " + px(expected);
    if (std::max(std::abs(lens.distortion.p1), std::abs(lens.distortion.p2)) > kTangential)
        return "the tangential distortion is no lens's";
    if (!keeps_order(lens)) return "the distortion is no lens's";
    return {};
}

Grade grade_of(const SparseModel& model, const std::map<std::string, double>& expected) {
    Grade grade;
    for (const auto& [id, image] : model.images) {
        ++grade.placed;
        const auto known = expected.find(image.name);
        std::string fault = lens_fault(camera_of(model, image), known == expected.end() ? 0 : known->second);
        if (!looks_at_its_points(model, image) && fault.empty()) fault = "points are behind the camera";
        if (fault.empty())
            ++grade.sound;
        else
            grade.faults[image.name] = fault;
    }
    double errors = 0, observations = 0;
    for (const auto& [id, point] : model.points) {
        errors += point.error * double(point.track.size());
        observations += double(point.track.size());
    }
    if (observations > 0) grade.error = errors / observations;
    return grade;
}

bool is_better(const Grade& first, const Grade& second) {
    // A path that jumps may be right. So one without the jump wins only if it is nearly as long.
    const bool comparable =
        10 * std::min(first.sound, second.sound) >= 9 * std::max(first.sound, second.sound);
    const auto worth = [&](const Grade& grade) { return comparable ? grade.credible() : grade.sound; };
    return std::tuple(worth(first), first.placed, second.contradictions, second.error) >
           std::tuple(worth(second), second.placed, first.contradictions, first.error);
}

bool is_enough(const Grade& grade, size_t photos) {
    return double(grade.credible()) >= kEnough * double(photos);
}

}  // namespace ewa::capture
