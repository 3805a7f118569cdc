// SPDX-License-Identifier: Apache-2.0
#include "scene/undistort.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "ewa/error.h"
#include "scene/lens.h"

namespace ewa::scene {

namespace {

// COLMAP's bounds of the new size over the old.
constexpr double kMinScale = 0.2, kMaxScale = 2.0;
constexpr double kShrink = 0.98;

[[noreturn]] void fail_folded() {
    throw InputError(
        "the lens distortion folds the picture over itself, so it cannot be undone; check the camera's "
        "distortion "
        "parameters or undistort the images with another tool");
}

glm::dvec2 normalized(const Camera& camera, double x, double y) {
    return {(x - camera.cx) / camera.fx, (y - camera.cy) / camera.fy};
}

glm::dvec2 source_pixel(const Camera& source, const Distortion& distortion, glm::dvec2 ray) {
    const glm::dvec2 p = distort(distortion, ray);
    return {source.fx * p.x + source.cx, source.fy * p.y + source.cy};
}

/// Of each side's undistorted border, the pixel that comes farthest in, as a tangent; infinite where none
/// does.
struct Inner {
    double left, right, top, bottom;
};

/// The largest of value(0) .. value(size - 1), each nothing where no ray in front reaches that pixel: looked
/// for in steps that get finer about the best, since a file may claim any size and any number of lenses.
/// `axis`, the pixel nearest to the principal point, is seen even where little of the side is.
template <class Value>
double largest(int size, double axis, const Value& value) {
    constexpr int kSamples = 128;
    double best = -std::numeric_limits<double>::infinity();
    int at = 0;
    const auto visit = [&](int i) {
        const std::optional<double> found = value(i);
        if (!found || !(*found > best)) return;
        best = *found;
        at = i;
    };
    visit(static_cast<int>(std::clamp(axis, 0.0, size - 1.0)));
    for (int low = 0, high = size - 1, step = 0; step != 1;) {
        step = std::max(1, (high - low) / kSamples);
        for (int i = low; i < high; i += step) visit(i);
        visit(high);
        low = std::max(0, at - step);
        high = std::min(size - 1, at + step);
    }
    return best;
}

Inner inner_border(const Camera& source, const Distortion& distortion) {
    // The ray of a pixel of the border along one axis, its sign such that the largest is the farthest in.
    const auto ray = [&](double x, double y, int axis, double sign) -> std::optional<double> {
        const auto found = undistort(distortion, normalized(source, x, y));
        return found ? std::optional(sign * (*found)[axis]) : std::nullopt;
    };
    const double right = source.width - 0.5, bottom = source.height - 0.5;
    Inner inner;
    inner.left = largest(source.height, source.cy, [&](int y) { return ray(0.5, y + 0.5, 0, 1); });
    inner.right = -largest(source.height, source.cy, [&](int y) { return ray(right, y + 0.5, 0, -1); });
    inner.top = largest(source.width, source.cx, [&](int x) { return ray(x + 0.5, 0.5, 1, 1); });
    inner.bottom = -largest(source.width, source.cx, [&](int x) { return ray(x + 0.5, bottom, 1, -1); });
    return inner;
}

/// New size over old along an axis. low, high: the inner border as tangents, each infinite where no ray in
/// front reaches it: a fisheye sees to its side and behind, while a perspective lens that does so on both
/// sides has folded.
double axis_scale(const Distortion& distortion, double focal, double center, int size, double low,
                  double high) {
    const bool none = std::isinf(low) && std::isinf(high);
    if (!(low < 0 && high > 0) || (none && distortion.lens == Lens::brown)) fail_folded();
    const double scale = std::min(-low * focal / center, high * focal / (size - 0.5 - center));
    if (!(scale > 0)) fail_folded();
    return std::clamp(scale, kMinScale, kMaxScale);
}

Camera scaled(const Camera& source, double scale_x, double scale_y) {
    Camera camera = source;
    camera.width = std::max(1, static_cast<int>(scale_x * source.width));
    camera.height = std::max(1, static_cast<int>(scale_y * source.height));
    camera.cx *= double(camera.width) / source.width;
    camera.cy *= double(camera.height) / source.height;
    return camera;
}

/// Whether the source holds the whole new picture, and the model has not folded anywhere in it. `first` is
/// looked at before the others, and becomes the point that failed: a little smaller, the picture mostly fails
/// there again.
bool covers(const Camera& source, const Distortion& distortion, const Camera& camera, glm::ivec2& first) {
    constexpr int kSteps = 64;
    const auto holds = [&](int i, int j) {
        const glm::dvec2 ray = normalized(camera, 0.5 + i * (camera.width - 1.0) / kSteps,
                                          0.5 + j * (camera.height - 1.0) / kSteps);
        const glm::dvec2 p = source_pixel(source, distortion, ray);
        return p.x >= 0 && p.x <= source.width && p.y >= 0 && p.y <= source.height &&
               one_to_one(distortion, ray);
    };
    if (!holds(first.x, first.y)) return false;
    for (int j = 0; j <= kSteps; ++j)
        for (int i = 0; i <= kSteps; ++i)
            if (!holds(i, j)) {
                first = {i, j};
                return false;
            }
    return true;
}

}  // namespace

Camera undistorted_camera(const Camera& source, const Distortion& distortion) {
    if (distortion.none()) return source;
    if (source.width < 2 || source.height < 2)
        throw InputError("a distorted picture needs at least 2 x 2 pixels");
    const Inner inner = inner_border(source, distortion);
    double x = axis_scale(distortion, source.fx, source.cx, source.width, inner.left, inner.right);
    double y = axis_scale(distortion, source.fy, source.cy, source.height, inner.top, inner.bottom);
    for (glm::ivec2 first(0);;) {
        const Camera camera = scaled(source, x, y);
        if (covers(source, distortion, camera, first)) return camera;
        x *= kShrink;
        y *= kShrink;
        if (x < kMinScale * kShrink && y < kMinScale * kShrink) fail_folded();
    }
}

Image undistort_image(const Image& image, const Camera& source, const Distortion& distortion,
                      const Camera& camera) {
    Image result(camera.width, camera.height, image.channels);
    for (int y = 0; y < result.height; ++y)
        for (int x = 0; x < result.width; ++x) {
            const glm::dvec2 p = source_pixel(source, distortion, normalized(camera, x + 0.5, y + 0.5));
            // Between the centres of the outermost pixels there are always four neighbours.
            const double u = std::clamp(p.x - 0.5, 0.0, image.width - 1.0);
            const double v = std::clamp(p.y - 0.5, 0.0, image.height - 1.0);
            const int x0 = std::min(int(u), image.width - 2), y0 = std::min(int(v), image.height - 2);
            const double a = u - x0, b = v - y0;
            for (int c = 0; c < image.channels; ++c) {
                const double top =
                    (1 - a) * double(image.at(x0, y0)[c]) + a * double(image.at(x0 + 1, y0)[c]);
                const double bottom =
                    (1 - a) * double(image.at(x0, y0 + 1)[c]) + a * double(image.at(x0 + 1, y0 + 1)[c]);
                result.at(x, y)[c] = static_cast<float>((1 - b) * top + b * bottom);
            }
        }
    return result;
}

}  // namespace ewa::scene
