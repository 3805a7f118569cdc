// SPDX-License-Identifier: Apache-2.0
#include "scene/intrinsics.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "core/typing.h"

namespace ewa::scene {
namespace {

// In larger sides of the image. The first is a pinhole of 179.9 degrees, the second one of 2 seconds of arc.
constexpr double kLeastFocal = 1e-3, kMostFocal = 1e5;
// Parallel rays have px per world unit, whatever that is.
constexpr double kLeastUnit = 1e-12, kMostUnit = 1e12;
// In focal lengths. An image that is cut out of a larger one has its principal point outside.
constexpr double kMostTangent = 20;
constexpr double kMostTerm = 1e6;  // at the image's corner

/// The powers of the distance from the axis that the terms have. Those of other formulas are angles and shares.
double power_of(const Distortion& lens, double Distortion::*term) {
    using Of = Distortion;
    if (lens.lens == Lens::fov || lens.lens == Lens::division || lens.lens == Lens::unified) return 0;
    const bool quotient = lens.lens == Lens::brown;
    for (const auto& [known, power] : {std::pair{&Of::k1, 2.0},
                                       {&Of::k2, 4.0},
                                       {&Of::k3, 6.0},
                                       {&Of::k4, quotient ? 2.0 : 8.0},
                                       {&Of::k5, quotient ? 4.0 : 10.0},
                                       {&Of::k6, quotient ? 6.0 : 12.0},
                                       {&Of::p1, 1.0},
                                       {&Of::p2, 1.0},
                                       {&Of::s1, 1.0},
                                       {&Of::s2, 3.0},
                                       {&Of::s3, 1.0},
                                       {&Of::s4, 3.0}})
        if (known == term) return power;
    return 0;
}

std::string term_fault(const Camera& camera, const Distortion& lens) {
    using Of = Distortion;
    constexpr std::pair<const char*, double Of::*> kNames[] = {
        {"k1", &Of::k1}, {"k2", &Of::k2}, {"k3", &Of::k3},    {"k4", &Of::k4}, {"k5", &Of::k5},
        {"k6", &Of::k6}, {"p1", &Of::p1}, {"p2", &Of::p2},    {"s1", &Of::s1}, {"s2", &Of::s2},
        {"s3", &Of::s3}, {"s4", &Of::s4}, {"skew", &Of::skew}};
    // Terms of a long lens may be large: they act on small distances.
    const double corner = std::min(
        1.0, 0.5 * std::hypot(double(camera.width), double(camera.height)) / std::min(camera.fx, camera.fy));
    for (const auto& [name, term] : kNames)
        if (!(std::abs(lens.*term) * std::pow(corner, power_of(lens, term)) <= kMostTerm))
            return std::string("the distortion term ") + name + " of " + core::shown_number(lens.*term) +
                   " is far beyond that of a lens";
    return {};
}

std::string image_of(const Camera& camera) {
    return "an image of " + std::to_string(camera.width) + " x " + std::to_string(camera.height) + " pixels";
}

/// How far the principal point lies outside the image, in focal lengths.
double outside(double center, int size, double focal) {
    return std::max({0.0, -center, center - size}) / focal;
}

}  // namespace

std::string intrinsics_fault(const Camera& camera, const Distortion& lens) {
    if (!(camera.fx > 0 && camera.fy > 0)) return "a focal length is not positive";
    const double side = std::max(camera.width, camera.height);
    const bool parallel = lens.lens == Lens::orthographic;
    const double least = parallel ? kLeastUnit : kLeastFocal * side,
                 most = parallel ? kMostUnit : kMostFocal * side;
    constexpr double kFraction = 2, kSmallest = 32;  // px
    for (const double focal : {camera.fx, camera.fy})
        if (!parallel && focal < kFraction && side >= kSmallest)
            return "a focal length of " + core::shown_number(focal) +
                   " px looks like a fraction of the width; " + image_of(camera) +
                   " needs it in pixels, and the principal point too";
    for (const double focal : {camera.fx, camera.fy})
        if (!(focal >= least && focal <= most))
            return "a focal length of " + core::shown_number(focal) +
                   (parallel ? " px per world unit" : " px") + " does not fit " + image_of(camera);
    const bool angles = lens.lens == Lens::fisheye || lens.lens == Lens::fisheye624;
    const double farthest = parallel ? kMostUnit : angles ? std::numbers::pi : kMostTangent;
    if (!(outside(camera.cx, camera.width, camera.fx) <= farthest &&
          outside(camera.cy, camera.height, camera.fy) <= farthest))
        return "the principal point (" + core::shown_number(camera.cx) + ", " +
               core::shown_number(camera.cy) + ") is too far outside " + image_of(camera);
    return term_fault(camera, lens);
}

}  // namespace ewa::scene
