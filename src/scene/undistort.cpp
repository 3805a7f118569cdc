#include "scene/undistort.h"

#include <algorithm>
#include <cmath>
#include <glm/mat2x2.hpp>
#include <limits>

#include "ewa/error.h"

namespace ewa::scene {

namespace {

/// d distort / d ray; symmetric, first index the row.
glm::dmat2 jacobian(const Distortion& d, glm::dvec2 p) {
    const double r2 = p.x * p.x + p.y * p.y;
    const double radial = 1 + r2 * (d.k1 + r2 * d.k2), slope = 2 * (d.k1 + 2 * r2 * d.k2);
    const double mixed = p.x * p.y * slope + 2 * (d.p1 * p.x + d.p2 * p.y);
    return {radial + p.x * p.x * slope + 2 * d.p1 * p.y + 6 * d.p2 * p.x, mixed, mixed,
            radial + p.y * p.y * slope + 6 * d.p1 * p.y + 2 * d.p2 * p.x};
}

struct Rectangle {
    double left = -std::numeric_limits<double>::infinity(), right = std::numeric_limits<double>::infinity();
    double top = left, bottom = right;
};

[[noreturn]] void fail_folded() {
    throw InputError(
        "the lens distortion folds the picture over itself, so it cannot be undone; check k1, k2, p1, p2 or "
        "undistort "
        "the images with another tool");
}

glm::dvec2 normalized(const Camera& camera, double x, double y) {
    return {(x - camera.cx) / camera.fx, (y - camera.cy) / camera.fy};
}

glm::dvec2 source_pixel(const Camera& source, const Distortion& distortion, glm::dvec2 ray) {
    const glm::dvec2 p = distort(distortion, ray);
    return {source.fx * p.x + source.cx, source.fy * p.y + source.cy};
}

/// The largest rectangle of rays inside the undistorted border.
Rectangle inner_rectangle(const Camera& source, const Distortion& distortion) {
    const auto ray = [&](double x, double y) {
        const std::optional<glm::dvec2> found = undistort(distortion, normalized(source, x, y));
        if (!found) fail_folded();
        return *found;
    };
    Rectangle inner;
    for (int y = 0; y < source.height; ++y) {
        inner.left = std::max(inner.left, ray(0.5, y + 0.5).x);
        inner.right = std::min(inner.right, ray(source.width - 0.5, y + 0.5).x);
    }
    for (int x = 0; x < source.width; ++x) {
        inner.top = std::max(inner.top, ray(x + 0.5, 0.5).y);
        inner.bottom = std::min(inner.bottom, ray(x + 0.5, source.height - 0.5).y);
    }
    return inner;
}

/// Newton's method may end on the far side of a fold: the model must be orientation-preserving over the whole
/// new picture, and the new picture must lie in the old.
void check_one_to_one(const Camera& source, const Distortion& distortion, const Camera& camera) {
    constexpr int kSteps = 32;
    for (int j = 0; j <= kSteps; ++j)
        for (int i = 0; i <= kSteps; ++i) {
            const double x = 0.5 + i * (camera.width - 1.0) / kSteps,
                         y = 0.5 + j * (camera.height - 1.0) / kSteps;
            const glm::dvec2 ray = normalized(camera, x, y);
            if (!(glm::determinant(jacobian(distortion, ray)) > 0)) fail_folded();
            const glm::dvec2 p = source_pixel(source, distortion, ray);
            if (!(p.x >= 0 && p.x <= source.width && p.y >= 0 && p.y <= source.height)) fail_folded();
        }
}

}  // namespace

glm::dvec2 distort(const Distortion& d, glm::dvec2 p) {
    const double r2 = p.x * p.x + p.y * p.y, radial = 1 + r2 * (d.k1 + r2 * d.k2);
    return {p.x * radial + 2 * d.p1 * p.x * p.y + d.p2 * (r2 + 2 * p.x * p.x),
            p.y * radial + d.p1 * (r2 + 2 * p.y * p.y) + 2 * d.p2 * p.x * p.y};
}

std::optional<glm::dvec2> undistort(const Distortion& distortion, glm::dvec2 point) {
    glm::dvec2 ray = point;
    const double tolerance = 1e-13 * (1 + std::abs(point.x) + std::abs(point.y));
    for (int iteration = 0; iteration < 100; ++iteration) {
        const glm::dvec2 residual = distort(distortion, ray) - point;
        if (std::max(std::abs(residual.x), std::abs(residual.y)) <= tolerance) return ray;
        ray -= glm::inverse(jacobian(distortion, ray)) * residual;
    }
    return std::nullopt;
}

Camera undistorted_camera(const Camera& source, const Distortion& distortion) {
    if (distortion.none()) return source;
    if (source.width < 2 || source.height < 2)
        throw InputError("a distorted picture needs at least 2 x 2 pixels");
    const Rectangle inner = inner_rectangle(source, distortion);
    if (!(inner.right > inner.left && inner.bottom > inner.top)) fail_folded();
    Camera camera = source;
    camera.fx = (source.width - 1) / (inner.right - inner.left);
    camera.fy = (source.height - 1) / (inner.bottom - inner.top);
    camera.cx = 0.5 - camera.fx * inner.left;
    camera.cy = 0.5 - camera.fy * inner.top;
    check_one_to_one(source, distortion, camera);
    return camera;
}

Image undistort_image(const Image& image, const Camera& source, const Distortion& distortion,
                      const Camera& camera) {
    Image result(image.width, image.height, image.channels);
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
