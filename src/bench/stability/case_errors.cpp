// SPDX-License-Identifier: Apache-2.0
#include "bench/stability/case_errors.h"

#include <algorithm>
#include <cfloat>
#include <cmath>

#include "bench/check.h"
#include "core/random.h"
#include "ewa/renderer.h"
#include "reference/render.h"
#include "reference/blend.h"
#include "shared/constants.h"

namespace ewa::bench {
namespace {

using reference::Picture;
using reference::Raster;
using reference::ReferenceGradient;
using reference::Values;

constexpr double kUnit = 0x1p-24;       // half a float32 step, relative
constexpr double kPictureFloor = 5e-6;  // of a well-conditioned scene
constexpr double kGradientFloor = 1e-4;
constexpr double kRoundings = 32;      // of a chain of float32 operations on each stored value
constexpr double kAtThreshold = 2e-4;  // relative distance at which float32 may decide differently
constexpr double kPerturbation = 1e-10;
constexpr int kPerturbations = 3;
constexpr double kLargest = FLT_MAX;
constexpr uint64_t kFewPixels = 4, kPixelsEach = 200;  // that may be close to a threshold

/// Moves each stored value by a relative kPerturbation, up or down.
Values perturbed(const Values& values, const glm::dvec3& eye, uint32_t draw) {
    Values out = values;
    uint32_t counter = 0;
    const auto sign = [&] {
        return core::pcg4d({counter++, draw, 0x636f6e64u, 0})[0] & 1 ? kPerturbation : -kPerturbation;
    };
    const auto relative = [&](std::vector<double>& group) {
        for (double& v : group) v += v * sign();
    };
    const auto absolute = [&](std::vector<double>& group) {
        for (double& v : group) v += std::clamp(std::abs(v), 1.0, 100.0) * sign();
    };
    relative(out.quaternions);
    relative(out.sh);
    absolute(out.log_scales);
    absolute(out.opacity_logits);
    for (size_t i = 0; i < out.size(); ++i) {
        const double s = sign();
        for (size_t k = 0; k < 3; ++k) out.means[3 * i + k] += s * (out.means[3 * i + k] - eye[int(k)]);
    }
    return out;
}

/// Pixels where a decision of the model (1/255, 0.99, the stop) is within kAtThreshold of its threshold.
std::vector<uint8_t> pixels_at_threshold(const Picture& picture) {
    const auto whiteners = reference::whiteners_of(picture.projected);
    const reference::Instances& lists = picture.instances;
    const int width = lists.grid.image_width, height = lists.grid.image_height;
    std::vector<uint8_t> at(size_t(width) * size_t(height));
    const auto near = [](double value, double threshold) {
        return std::abs(value - threshold) <= kAtThreshold * threshold;
    };
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) {
            const uint32_t tile = lists.grid.tile_of(x, y);
            double transmittance = 1;
            bool hangs = false;
            for (size_t k = lists.first_of_tile[tile]; k < lists.first_of_tile[tile + 1]; ++k) {
                const uint32_t splat = lists.sorted[k].splat;
                const double raw = reference::sample(picture.projected[splat], whiteners[splat],
                                                     reference::pixel_centre(x, y))
                                       .raw;
                const double alpha = raw >= shared::ALPHA_MIN ? std::min(raw, shared::ALPHA_MAX) : 0;
                const double next = transmittance * (1 - alpha);
                // At exactly (1 - ALPHA_MAX)^2 both sides decide equally.
                const bool exact = reference::stops(next) && raw > shared::ALPHA_MAX;
                hangs = hangs || near(raw, shared::ALPHA_MIN) || near(raw, shared::ALPHA_MAX) ||
                        (alpha > 0 && !exact && near(next, shared::TRANSMITTANCE_STOP));
                if (reference::stops(next)) break;
                transmittance = next;
            }
            at[size_t(y) * size_t(width) + size_t(x)] = hangs;
        }
    return at;
}

struct Difference {
    double largest = 0;
    bool finite = true;
};

/// Of the pixels that are not excluded, divided by scale.
template <class Pixel>
Difference picture_difference(const Raster& expected, const std::vector<uint8_t>& excluded, double scale,
                              Pixel actual) {
    Difference d;
    for (int y = 0; y < expected.height; ++y)
        for (int x = 0; x < expected.width; ++x)
            for (int c = 0; c < 3; ++c) {
                const double value = actual(x, y, c);
                d.finite = d.finite && std::isfinite(value);
                if (excluded[size_t(y) * size_t(expected.width) + size_t(x)]) continue;
                const double e = std::abs(value - expected.at(x, y)[c]) / scale;
                if (!(e <= d.largest)) d.largest = e;
            }
    return d;
}

double scale_of(const Raster& raster) {
    double scale = 1;
    for (const double v : raster.values) scale = std::max(scale, std::abs(v));
    return scale;
}

/// The norm of the values clamped to the range of float32, with squares that cannot overflow.
double norm_of(const std::vector<double>& v) {
    double largest = 0, sum = 0;
    for (const double x : v) largest = std::max(largest, std::min(std::abs(x), kLargest));
    for (const double x : v) sum += largest > 0 ? std::pow(std::min(std::abs(x), kLargest) / largest, 2) : 0;
    return largest * std::sqrt(sum);
}

/// The least norm of the quaternion gradient to measure an error against. It is zero for round splats, which
/// a rotation does not change; then this share of the gradient of the scales replaces it.
double least_quaternion_norm(const StabilityCase& one, const Values& gradient) {
    constexpr double kShare = 1e-3;
    const Values values = one.gaussians;
    double largest = 0;
    for (size_t i = 0; i < values.size(); ++i) {
        const double norm = reference::robust_norm(reference::read_splat(values, i).quaternion);
        if (std::isfinite(norm)) largest = std::max(largest, norm);
    }
    return largest > 0 ? kShare * norm_of(gradient.log_scales) / largest : 0;
}

bool all_finite(const Gaussians& g) {
    const auto finite = [](const std::vector<float>& v) {
        return std::all_of(v.begin(), v.end(), [](float x) { return std::isfinite(x); });
    };
    return finite(g.means) && finite(g.quaternions) && finite(g.log_scales) && finite(g.opacity_logits) &&
           finite(g.sh);
}

/// The error of the reference image if each determinant is a c - b^2 in float32. It shows why the pipeline
/// adds the minors instead.
double plain_determinant_error(const Picture& picture, const RenderOptions& options,
                               const std::vector<uint8_t>& excluded, double scale) {
    std::vector<reference::Projected> plain = picture.projected;
    for (reference::Projected& p : plain) {
        const float a = float(p.a), b = float(p.b), c = float(p.c);
        p.det = double(a * c - b * b);
        if (!(p.det > 0)) p.visible = false;  // as renderers do that compute it this way
    }
    const auto order = reference::depth_order(plain);
    const auto lists = reference::make_instances(plain, order, picture.instances.grid);
    const auto blended = reference::blend(plain, lists, options.background);
    return picture_difference(picture.blended.color, excluded, scale,
                              [&](int x, int y, int c) { return blended.color.at(x, y)[c]; })
        .largest;
}

/// For each group of the gradient: the least norm that its error is divided by.
std::vector<double> least_norms(const StabilityCase& one, const Values& gradient) {
    return {0, least_quaternion_norm(one, gradient), 0, 0, 0};
}

struct Conditions {
    double picture = 0, loss = 0;
    double groups[5] = {};
};

/// The error of the reference under changes of each stored value, divided by the size of the change: the
/// largest of several.
Conditions conditions_of(const StabilityCase& one, const Image& photo, const ReferenceGradient& expected,
                         const std::vector<uint8_t>& excluded, double scale) {
    const Values values = one.gaussians;
    const std::vector<double> least = least_norms(one, expected.gradient);
    Conditions k;
    for (uint32_t draw = 0; draw < kPerturbations; ++draw) {
        const ReferenceGradient moved = reference::loss_gradient(
            perturbed(values, one.camera.position(), draw), one.camera, photo, one.options);
        const double picture =
            picture_difference(expected.picture.blended.color, excluded, scale, [&](int x, int y, int c) {
                return moved.picture.blended.color.at(x, y)[c];
            }).largest;
        k.picture = std::max(k.picture, picture / kPerturbation);
        k.loss = std::max(
            k.loss, std::abs(moved.loss - expected.loss) / std::max(1.0, expected.loss) / kPerturbation);
        int group = 0;
        for_each_group(moved.gradient, expected.gradient, [&](const char*, const auto& a, const auto& b) {
            k.groups[group] =
                std::max(k.groups[group], relative_distance(a, b, least[size_t(group)]) / kPerturbation);
            ++group;
        });
    }
    return k;
}

/// Without a finite condition number, the floor is the bound.
double bound(double floor, double condition) {
    if (!std::isfinite(condition)) return floor;
    return std::max(floor, kRoundings * condition * kUnit);
}

}  // namespace

bool StabilityResult::good() const {
    return finite && skipped == skipped_by_twin &&
           pixels_at_threshold <= std::max(kFewPixels, pixels / kPixelsEach) &&
           std::all_of(comparisons.begin(), comparisons.end(), [](const Comparison& c) { return c.good(); });
}

StabilityResult compare_with_twin(const std::shared_ptr<gpu::Device>& device, const StabilityCase& one,
                                  const Gaussians& drawn) {
    const Image photo = stability_photo(one.camera.width, one.camera.height);
    const ReferenceGradient expected =
        reference::loss_gradient(one.gaussians, one.camera, photo, one.options);
    const std::vector<uint8_t> at_threshold = pixels_at_threshold(expected.picture);
    const double scale = scale_of(expected.picture.blended.color);
    const Conditions condition = conditions_of(one, photo, expected, at_threshold, scale);

    StabilityResult result;
    result.name = one.name;
    result.what = one.what;
    result.splats = uint32_t(one.gaussians.size());
    result.drawn = uint32_t(expected.picture.order.size());
    result.skipped_by_twin = expected.picture.skipped_nonfinite;
    result.pixels = at_threshold.size();
    result.pixels_at_threshold = uint64_t(std::count(at_threshold.begin(), at_threshold.end(), 1));
    result.plain_determinant = plain_determinant_error(expected.picture, one.options, at_threshold, scale);

    Renderer renderer(device, drawn, one.options);
    const Rendering rendering = renderer.render(one.camera);
    result.skipped = renderer.skipped_nonfinite();
    const Difference picture =
        picture_difference(expected.picture.blended.color, at_threshold, scale,
                           [&](int x, int y, int c) { return double(rendering.color.at(x, y)[c]); });
    result.comparisons.push_back(
        {"picture", picture.largest, bound(kPictureFloor, condition.picture), condition.picture});

    const LossGradient gradient = loss_gradient(device, drawn, one.camera, photo, one.options);
    result.loss = gradient.loss;
    result.finite = picture.finite && std::isfinite(gradient.loss) && all_finite(gradient.gradient);
    result.comparisons.push_back({"loss",
                                  std::abs(gradient.loss - expected.loss) / std::max(1.0, expected.loss),
                                  bound(kPictureFloor, condition.loss), condition.loss});
    const std::vector<double> least = least_norms(one, expected.gradient);
    int group = 0;
    for_each_group(gradient.gradient, expected.gradient, [&](const char* name, const auto& a, const auto& b) {
        const double k = condition.groups[group];
        result.comparisons.push_back(
            {name, relative_distance(a, b, least[size_t(group)]), bound(kGradientFloor, k), k});
        ++group;
    });
    return result;
}

}  // namespace ewa::bench
