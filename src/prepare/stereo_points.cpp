// SPDX-License-Identifier: Apache-2.0
#include "prepare/stereo_points.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>

#include "core/parallel.h"
#include "prepare/depth_points.h"
#include "prepare/viewed_sphere.h"
#include "scene/frame_images.h"
#include "scene/plane_sweep.h"

namespace ewa::train {
namespace {

using scene::SweepPlanes;
using scene::SweptDepths;
using scene::SweptImage;

constexpr size_t kMostViews = 96, kScoutViews = 16, kMostOthers = 4;
constexpr double kPixels = 20000;  // of an image, about
constexpr int kLeastSide = 64;     // px
constexpr double kAngle = 0.12, kLeastAngle = 0.035,
                 kMostAngle = 0.52;  // radians between two views of a point
constexpr double kNearest =
    8;  // largest inverse depth at first, times the distance of what the cameras look at
constexpr float kClearScore = 0.8f, kLeastScore = 0.6f;
constexpr double kAgreement = 0.015;  // of the inverse depth
constexpr size_t kLeastPixels = 500, kLeastStereoPoints = 1000;
constexpr float kOpaque = 0.5f;

struct View {
    SweptImage image;
    Image color;
    std::vector<uint8_t> counts;  // of each pixel, whether its depth does
    double depth = 1;             // along the axis, of what the camera looks at
    std::vector<int> others;      // views
    SweptDepths found;
};

Image gray_of(const Image& color) {
    Image gray(color.width, color.height, 1);
    for (size_t i = 0; i < gray.pixels.size(); ++i)
        gray.pixels[i] = (color.pixels[3 * i] + color.pixels[3 * i + 1] + color.pixels[3 * i + 2]) / 3;
    return gray;
}

/// A pixel that is mostly masked or transparent does not count: its colour is the background's.
View view_of(const Frame& frame, const std::array<float, 3>& background) {
    const std::shared_ptr<const Image> loaded = scene::image_of(frame);
    const double pixels = double(loaded->width) * loaded->height;
    const int factor = std::max(1, int(std::lround(std::sqrt(pixels / kPixels))));
    const Image small = downscale(*loaded, factor);
    View view;
    view.color = over_background(small, background);
    view.image = {gray_of(view.color), downscale(frame.camera, factor)};
    view.counts.assign(view.image.gray.pixels.size(), 1);
    if (small.channels == 4)
        for (size_t i = 0; i < view.counts.size(); ++i) view.counts[i] = small.pixels[4 * i + 3] > kOpaque;
    return view;
}

/// In px; z is the depth.
glm::dvec3 seen_at(const Camera& camera, const glm::dvec3& point) {
    const glm::dvec3 p = camera.rotation * point + camera.translation;
    return {camera.fx * p.x / p.z + camera.cx, camera.fy * p.y / p.z + camera.cy, p.z};
}

bool shows(const Camera& camera, const glm::dvec3& seen) {
    return seen.z > 0 && seen.x >= 0 && seen.y >= 0 && seen.x < camera.width && seen.y < camera.height;
}

/// The views that see what view i looks at from about the angle that is best: a smaller one tells depths less exactly, and with a
/// larger one things look different.
std::vector<int> others_of(const std::vector<View>& views, size_t i) {
    const Camera& own = views[i].image.camera;
    const glm::dvec3 target = own.position() + views[i].depth * viewing_direction(own);
    std::vector<std::pair<double, int>> ranked;
    for (size_t j = 0; j < views.size(); ++j) {
        const Camera& other = views[j].image.camera;
        if (j == i || !shows(other, seen_at(other, target))) continue;
        const glm::dvec3 a = own.position() - target, b = other.position() - target;
        const double angle = std::atan2(glm::length(glm::cross(a, b)), glm::dot(a, b));
        if (angle < kLeastAngle || angle > kMostAngle) continue;
        ranked.emplace_back(std::abs(std::log(angle / kAngle)), int(j));
    }
    std::ranges::sort(ranked);
    std::vector<int> others;
    for (size_t k = 0; k < std::min(ranked.size(), kMostOthers); ++k) others.push_back(ranked[k].second);
    return others;
}

/// So many that a pixel moves by about one from plane to plane.
SweepPlanes planes_for(const SweptImage& image, const std::vector<const SweptImage*>& others, double most) {
    double farthest = 0;
    for (const SweptImage* other : others)
        farthest = std::max(farthest, glm::distance(other->camera.position(), image.camera.position()));
    const double moved = most * farthest * std::max(image.camera.fx, image.camera.fy);
    return {most, int(std::clamp(std::ceil(moved), 24.0, 192.0)) + 1};
}

SweptDepths sweep(const std::vector<View>& views, size_t i, double most) {
    std::vector<const SweptImage*> others;
    for (const int j : views[i].others) others.push_back(&views[size_t(j)].image);
    if (others.empty()) return {};
    SweptDepths found = scene::sweep_planes(views[i].image, others, planes_for(views[i].image, others, most));
    for (size_t p = 0; p < found.score.size(); ++p)
        if (!views[i].counts[p]) found.score[p] = -1;
    return found;
}

/// The median and the 97th percentile of depth / true depth, of some views; zeros if too few pixels tell.
std::pair<double, double> scouted(const std::vector<View>& views) {
    std::vector<View> small;
    for (const View& view : views) {
        View half;
        half.image = {downscale(view.image.gray, 2), downscale(view.image.camera, 2)};
        const size_t width = size_t(half.image.gray.width);
        for (size_t p = 0; p < half.image.gray.pixels.size(); ++p)
            half.counts.push_back(view.counts[2 * (p / width) * size_t(view.color.width) + 2 * (p % width)]);
        half.depth = view.depth;
        half.others = view.others;
        small.push_back(std::move(half));
    }
    const size_t count = std::min(small.size(), kScoutViews);
    std::vector<SweptDepths> found(count);
    core::on_all_cores(count, [&](size_t k) {
        const size_t i = k * small.size() / count;
        found[k] = sweep(small, i, kNearest / small[i].depth);
    });
    std::vector<double> ratios;
    for (size_t k = 0; k < count; ++k)
        for (size_t p = 0; p < found[k].score.size(); ++p)
            if (found[k].score[p] > kClearScore)
                ratios.push_back(double(found[k].inverse[p]) * small[k * small.size() / count].depth);
    if (ratios.size() < kLeastPixels) return {0, 0};
    std::ranges::sort(ratios);
    return {ratios[ratios.size() / 2], ratios[ratios.size() * 97 / 100]};
}

/// The inverse depth at a place of view j, 0 without.
double inverse_at(const View& view, const glm::dvec3& seen) {
    if (view.found.inverse.empty()) return 0;
    const size_t at = size_t(int(seen.y)) * size_t(view.color.width) + size_t(int(seen.x));
    return view.found.score[at] >= kLeastScore ? double(view.found.inverse[at]) : 0;
}

/// The depths of view i that other views confirm; 0 elsewhere.
Image confirmed_depths(const std::vector<View>& views, size_t i) {
    const View& view = views[i];
    const Camera& camera = view.image.camera;
    Image depths(view.color.width, view.color.height, 1);
    if (view.found.inverse.empty()) return depths;
    for (int y = 0; y < depths.height; ++y)
        for (int x = 0; x < depths.width; ++x) {
            const size_t at = size_t(y) * size_t(depths.width) + size_t(x);
            const double inverse = double(view.found.inverse[at]);
            if (view.found.score[at] < kLeastScore || inverse <= 0) continue;
            const glm::dvec3 ray((x + 0.5 - camera.cx) / camera.fx, (y + 0.5 - camera.cy) / camera.fy, 1);
            const glm::dvec3 point = camera.position() + glm::transpose(camera.rotation) * (ray / inverse);
            size_t agree = 0, able = 0;
            for (const int j : view.others) {
                const View& other = views[size_t(j)];
                const glm::dvec3 seen = seen_at(other.image.camera, point);
                able += !other.found.inverse.empty();
                if (!shows(other.image.camera, seen)) continue;
                agree += std::abs(inverse_at(other, seen) * seen.z - 1) <= kAgreement;
            }
            if (agree > 0 && agree >= std::min<size_t>(2, able)) depths.pixels[at] = float(1 / inverse);
        }
    return depths;
}

std::vector<View> views_of(const Dataset& dataset, const std::vector<int>& frames,
                           const std::array<float, 3>& background) {
    std::vector<const Frame*> usable;
    for (const Frame* frame : scene::frames_at(dataset, frames))
        if (!frame->image_path.empty() && frame->camera.distortion.none() && !frame->camera.readout &&
            std::min(frame->camera.width, frame->camera.height) >= kLeastSide)
            usable.push_back(frame);
    std::vector<View> views(std::min(usable.size(), kMostViews));
    const auto frame_of = [&](size_t i) { return usable[i * usable.size() / views.size()]; };
    core::on_all_cores(
        views.size(), [&](size_t i) { views[i] = view_of(*frame_of(i), background); },
        scene::images_at_once(usable));
    const Sphere sphere = viewed_sphere(dataset, frames);
    for (View& view : views) {
        const Camera& camera = view.image.camera;
        const double ahead = glm::dot(sphere.center - camera.position(), viewing_direction(camera));
        view.depth = ahead > 0.5 * sphere.radius ? ahead : sphere.radius;
    }
    return views;
}

void choose_others(std::vector<View>& views) {
    for (size_t i = 0; i < views.size(); ++i) views[i].others = others_of(views, i);
}

size_t pixels_with_depth(const Image& depths) {
    return size_t(std::ranges::count_if(depths.pixels, [](float z) { return z > 0; }));
}

}  // namespace

StereoPoints points_by_stereo(const Dataset& dataset, const std::vector<int>& frames,
                              const std::array<float, 3>& background, uint32_t count, uint64_t seed) {
    std::vector<View> views = views_of(dataset, frames, background);
    choose_others(views);
    const auto [median, nearest] = scouted(views);
    if (median <= 0) return {};
    std::vector<double> most;
    for (View& view : views) {
        most.push_back(1.3 * nearest / view.depth);
        view.depth /= median;
    }
    choose_others(views);
    core::on_all_cores(views.size(), [&](size_t i) { views[i].found = sweep(views, i, most[i]); });
    std::vector<Image> depths(views.size());
    core::on_all_cores(views.size(), [&](size_t i) { depths[i] = confirmed_depths(views, i); });
    size_t all = 0;
    std::vector<size_t> useful;
    for (size_t i = 0; i < views.size(); ++i) {
        const size_t pixels = pixels_with_depth(depths[i]);
        all += pixels;
        if (pixels > 0) useful.push_back(i);
    }
    if (all < kLeastStereoPoints) return {};
    // As many of each view: most of them see little of what is hard to see.
    StereoPoints points;
    for (size_t k = 0; k < useful.size(); ++k) {
        const auto part = [&](size_t n) { return uint32_t(uint64_t(count) * n / useful.size()); };
        const size_t i = useful[k];
        add_points({views[i].image.camera, views[i].color, depths[i]}, part(k + 1) - part(k), seed,
                   uint32_t(i), points.cloud);
    }
    points.images = useful.size();
    return points;
}

}  // namespace ewa::train
