// SPDX-License-Identifier: Apache-2.0
// The device's gradient of the loss against central differences of the CPU reference's loss, a parameter
// group at a time: neither side knows the other's formulas.
#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <tuple>

#include "ewa/renderer.h"
#include "gpu/test_device.h"
#include "reference/render.h"
#include "support/gradient_check.h"
#include "support/random_lens.h"
#include "support/random_scene.h"
#include "support/random_sky.h"

namespace ewa::test {
namespace {

struct Case {
    SplatKind kind;
    size_t splats;
    int width, height, sh_degree;
    Footprint kernel;
    uint64_t seed;
};

class Gradient : public testing::TestWithParam<Case> {};

TEST_P(Gradient, IsTheSlopeOfTheReferencesLoss) {
    const Case& c = GetParam();
    SCOPED_TRACE(seed_text(c.seed));
    const Camera camera = random_camera(c.seed, c.width, c.height);
    const Gaussians gaussians = random_gaussians(c.seed + 1, c.splats, c.kind, camera, c.sh_degree);
    Image target = random_target(c.seed + 2, c.width, c.height);
    RenderOptions options;
    options.kernel = c.kernel;
    options.background = {0.3f, 0.6f, 0.1f};
    if (c.seed % 2 == 0) options.sky = std::make_shared<const SkyMap>(random_sky(c.seed, 16));
    reference::ReferenceOptions other;
    if (c.splats == 4) other.loss = {0.2, 4, 0.5};
    if (c.splats == 20) {
        target = cut_out(target, c.seed + 3);
        other.loss.alpha = 0.6;
    }
    const LossGradient device_gradient =
        loss_gradient(device(), gaussians, camera, target, options, false, other.loss);
    const reference::ReferenceGradient cpu =
        reference::loss_gradient(gaussians, camera, target, options, other);

    // The loss jumps where a contribution crosses 1/255; the best of several steps is one that crosses none.
    reference::Values values = gaussians;
    const auto loss = [&] { return reference::loss_gradient(values, camera, target, options, other).loss; };
    const auto differences = [&](std::vector<double>& group, const std::vector<double>& claimed) {
        std::vector<double> out;
        for (size_t i = 0; i < group.size(); ++i)
            out.push_back(best_central_difference(loss, group[i], claimed[i], 1e-4, 1e-7));
        return out;
    };
    // float32 against float64: a share of 2e-4 of an element, and 1e-4 of the group's largest, where a pixel
    // stands on the other side of a threshold or terms cancel.
    GradientTolerance tolerance;
    tolerance.cosine = 1e-6;
    tolerance.norm = 5e-4;
    tolerance.element_relative = 2e-3;
    tolerance.element_absolute = 2e-4;
    const auto check = [&](const char* name, std::vector<double>& group, const std::vector<float>& actual,
                           const std::vector<double>& claimed) {
        const std::vector<double> wide(actual.begin(), actual.end());
        const std::vector<double> slope = differences(group, claimed);
        EXPECT_TRUE(gradients_agree(wide, slope, tolerance)) << name;
        double largest = 0;
        for (const double s : slope) largest = std::max(largest, std::abs(s));
        EXPECT_GT(largest, 1e-6) << name << " has no gradient to check";
    };
    const Gaussians& g = device_gradient.gradient;
    check("means", values.means, g.means, cpu.gradient.means);
    check("quaternions", values.quaternions, g.quaternions, cpu.gradient.quaternions);
    check("log scales", values.log_scales, g.log_scales, cpu.gradient.log_scales);
    check("opacities", values.opacity_logits, g.opacity_logits, cpu.gradient.opacity_logits);
    check("sh", values.sh, g.sh, cpu.gradient.sh);
}

/// The device's and the reference's gradient by the camera's motion, against central differences of the reference's loss.
TEST_P(Gradient, ByTheCamerasMotionIsTheSlopeOfTheReferencesLoss) {
    const Case& c = GetParam();
    SCOPED_TRACE(seed_text(c.seed));
    const Camera camera = random_camera(c.seed, c.width, c.height);
    const Gaussians gaussians = random_gaussians(c.seed + 1, c.splats, c.kind, camera, c.sh_degree);
    const Image target = random_target(c.seed + 2, c.width, c.height);
    RenderOptions options;
    options.kernel = c.kernel;
    const reference::Values values = gaussians;
    const CameraMotion actual = loss_gradient(device(), gaussians, camera, target, options).camera;
    const CameraMotion cpu = reference::loss_gradient(values, camera, target, options).camera;
    CameraMotion motion;
    const auto loss = [&] {
        return reference::loss_gradient(values, moved(camera, motion), target, options).loss;
    };
    const auto slope = [&](double& value, double claimed) {
        return best_central_difference(loss, value, claimed, 1e-4, 1e-7);
    };
    std::vector<double> rotation, shift;
    for (int k = 0; k < 3; ++k) {
        rotation.push_back(slope(motion.rotation[k], cpu.rotation[k]));
        shift.push_back(slope(motion.shift[k], cpu.shift[k]));
    }
    const std::vector<double> focal{slope(motion.log_focal, cpu.log_focal)};
    const auto list = [](const glm::dvec3& v) { return std::vector<double>{v.x, v.y, v.z}; };
    for (const auto& [who, by, norm] : {std::tuple{"device", &actual, 1e-4}, {"reference", &cpu, 1e-5}}) {
        GradientTolerance tolerance;
        tolerance.cosine = norm * norm;
        tolerance.norm = norm;
        EXPECT_TRUE(gradients_agree(list(by->rotation), rotation, tolerance)) << who;
        EXPECT_TRUE(gradients_agree(list(by->shift), shift, tolerance)) << who;
        EXPECT_TRUE(gradients_agree(std::vector<double>{by->log_focal}, focal, tolerance)) << who;
    }
}

INSTANTIATE_TEST_SUITE_P(All, Gradient,
                         testing::Values(Case{SplatKind::ordinary, 5, 24, 17, 0, Footprint::peak, 5001},
                                         Case{SplatKind::ordinary, 4, 23, 18, 3, Footprint::peak, 5012},
                                         Case{SplatKind::ordinary, 5, 24, 17, 1, Footprint::antialias, 5023},
                                         Case{SplatKind::ordinary, 5, 17, 24, 1, Footprint::density, 5034},
                                         Case{SplatKind::needles, 5, 24, 17, 0, Footprint::density, 5056},
                                         Case{SplatKind::ordinary, 20, 24, 17, 0, Footprint::peak, 5045}),
                         [](const testing::TestParamInfo<Case>& tested) {
                             const Case& c = tested.param;
                             return std::string(name_of(c.kind)) + "_" + std::to_string(c.splats) + "_sh" +
                                    std::to_string(c.sh_degree) + "_kernel" + std::to_string(int(c.kernel));
                         });

/// The splats' gradients of the device and of the reference against central differences of the reference's loss.
void expect_slopes(const Gaussians& gaussians, const Camera& camera, const Image& target,
                   const RenderOptions& options, const LossGradient& actual,
                   const reference::ReferenceGradient& cpu) {
    reference::Values values = gaussians;
    const auto loss = [&] { return reference::loss_gradient(values, camera, target, options).loss; };
    const auto check = [&](const char* group_name, std::vector<double>& group,
                           const std::vector<float>& of_device, const std::vector<double>& claimed) {
        std::vector<double> slope;
        for (size_t i = 0; i < group.size(); ++i)
            slope.push_back(best_central_difference(loss, group[i], claimed[i], 1e-4, 1e-7));
        GradientTolerance tolerance;
        tolerance.cosine = 1e-6;
        tolerance.norm = 5e-4;
        tolerance.element_relative = 2e-3;
        tolerance.element_absolute = 2e-4;
        EXPECT_TRUE(gradients_agree(claimed, slope, tolerance)) << group_name << " of the reference";
        EXPECT_TRUE(
            gradients_agree(std::vector<double>(of_device.begin(), of_device.end()), slope, tolerance))
            << group_name << " of the device";
    };
    const Gaussians& g = actual.gradient;
    check("means", values.means, g.means, cpu.gradient.means);
    check("quaternions", values.quaternions, g.quaternions, cpu.gradient.quaternions);
    check("log scales", values.log_scales, g.log_scales, cpu.gradient.log_scales);
    check("opacities", values.opacity_logits, g.opacity_logits, cpu.gradient.opacity_logits);
    check("sh", values.sh, g.sh, cpu.gradient.sh);
}

/// The same of these parts of the gradient by the camera's motion.
void expect_camera_slopes(const Gaussians& gaussians, const Camera& camera, const Image& target,
                          const RenderOptions& options, const CameraMotion& actual, const CameraMotion& cpu,
                          std::initializer_list<glm::dvec3 CameraMotion::*> parts) {
    CameraMotion motion;
    const auto loss = [&] {
        return reference::loss_gradient(gaussians, moved(camera, motion), target, options).loss;
    };
    const auto list = [](const glm::dvec3& v) { return std::vector<double>{v.x, v.y, v.z}; };
    int index = 0;
    for (const auto part : parts) {
        std::vector<double> slope;
        for (int k = 0; k < 3; ++k)
            slope.push_back(best_central_difference(loss, (motion.*part)[k], (cpu.*part)[k], 1e-4, 1e-7));
        GradientTolerance tolerance;
        tolerance.cosine = 1e-7;
        tolerance.norm = 3e-4;
        EXPECT_TRUE(gradients_agree(list(cpu.*part), slope, tolerance))
            << "camera of the reference, " << index;
        EXPECT_TRUE(gradients_agree(list(actual.*part), slope, tolerance))
            << "camera of the device, " << index;
        ++index;
    }
}

/// Through each lens: the device's and the reference's gradient against central differences of the reference's loss.
TEST(GradientThroughALens, IsTheSlopeOfTheReferencesLoss) {
    for (const Footprint kernel : {Footprint::peak, Footprint::antialias, Footprint::density})
        for (const NamedCamera& lens : random_lenses(5200, 25, 17)) {
            SCOPED_TRACE(lens.name);
            const Camera& camera = lens.camera;
            const Gaussians gaussians = gaussians_around(5201, 9, camera, 1);
            const Image target = random_target(5202, 25, 17);
            RenderOptions options;
            options.kernel = kernel;
            const LossGradient actual = loss_gradient(device(), gaussians, camera, target, options);
            const reference::ReferenceGradient cpu =
                reference::loss_gradient(gaussians, camera, target, options);
            expect_slopes(gaussians, camera, target, options, actual, cpu);
            expect_camera_slopes(gaussians, camera, target, options, actual.camera, cpu.camera,
                                 {&CameraMotion::rotation, &CameraMotion::shift});
        }
}

/// Through rolling shutters.
TEST(GradientOfARollingShutter, IsTheSlopeOfTheReferencesLoss) {
    for (const Footprint kernel : {Footprint::peak, Footprint::antialias, Footprint::density})
        for (const NamedCamera& rolling : rolling_cameras(5300, 25, 17)) {
            SCOPED_TRACE(rolling.name);
            const Gaussians gaussians = gaussians_around(5301, 9, rolling.camera, 1);
            const Image target = random_target(5302, 25, 17);
            RenderOptions options;
            options.kernel = kernel;
            const LossGradient actual = loss_gradient(device(), gaussians, rolling.camera, target, options);
            const reference::ReferenceGradient cpu =
                reference::loss_gradient(gaussians, rolling.camera, target, options);
            expect_slopes(gaussians, rolling.camera, target, options, actual, cpu);
            expect_camera_slopes(gaussians, rolling.camera, target, options, actual.camera, cpu.camera,
                                 {&CameraMotion::rotation, &CameraMotion::shift, &CameraMotion::readout_turn,
                                  &CameraMotion::readout_shift});
        }
}

/// A slope of the device's own loss, all the way round: the gradient belongs to the picture that is drawn.
TEST(GradientOfTheDevice, FollowsItsOwnLoss) {
    const Camera camera = random_camera(5100, 48, 36);
    const Gaussians gaussians = random_gaussians(5101, 30, SplatKind::ordinary, camera, 1);
    const Image target = random_target(5102, 48, 36);
    const RenderOptions options;
    const LossGradient at = loss_gradient(device(), gaussians, camera, target, options);
    // Along the gradient, where float32's rounding of the loss is small beside its change.
    const auto moved = [&](double t) {
        Gaussians g = gaussians;
        const auto add = [&](std::vector<float>& values, const std::vector<float>& by) {
            for (size_t i = 0; i < values.size(); ++i) values[i] += float(t * double(by[i]));
        };
        add(g.means, at.gradient.means);
        add(g.opacity_logits, at.gradient.opacity_logits);
        add(g.log_scales, at.gradient.log_scales);
        add(g.sh, at.gradient.sh);
        return loss_gradient(device(), g, camera, target, options).loss;
    };
    double square = 0;
    for (const auto* group :
         {&at.gradient.means, &at.gradient.opacity_logits, &at.gradient.log_scales, &at.gradient.sh})
        for (const float g : *group) square += double(g) * double(g);
    const double step = 1e-3 / std::sqrt(square);  // a thousandth of a unit
    const double slope = (moved(step) - moved(-step)) / (2 * step);
    // A contribution that crosses the cut moves the loss and has no gradient: 1.4 percent here.
    EXPECT_NEAR(slope, square, 0.03 * square);
}

}  // namespace
}  // namespace ewa::test
