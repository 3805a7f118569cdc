// SPDX-License-Identifier: Apache-2.0
// Motions of cameras on the device against the CPU reference: the moved camera, and Adam's step.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstring>
#include <limits>

#include "gpu/guarded.h"
#include "gpu/reference_inputs.h"
#include "passes/passes.h"
#include "pipeline/backward.h"
#include "pipeline/frame_inputs.h"
#include "reference/motion.h"
#include "scene/native_lens.h"
#include "support/random_lens.h"

namespace ewa::test {
namespace {

constexpr uint32_t kCameras = 3, kOwn = 1, kMotionFloats = shared::MOTION_VALUES;
using pipeline::MotionBasis;

/// One for each camera, all different.
std::vector<MotionBasis> bases() {
    Random random(80);
    std::vector<MotionBasis> all(kCameras);
    for (MotionBasis& basis : all)
        for (float& value : basis) value = float(random.normal());
    return all;
}

void set_motion(pipeline::Motions& motions, const CameraMotion& m) {
    std::vector<float> values(shared::MOTION_FLOATS * kCameras, 0.25f);  // of the others too
    float* own = &values[shared::MOTION_FLOATS * kOwn];
    for (int k = 0; k < 3; ++k) {
        own[k] = float(m.rotation[k]);
        own[4 + k] = float(m.shift[k]);
    }
    own[3] = float(m.log_focal);
    motions.values.upload(std::span<const float>(values));
}

shared::CameraBlock block_of(const Camera& camera, const CameraMotion& motion, const glm::dvec3& origin) {
    Rig& r = rig();
    pipeline::Motions motions(*device(), {bases(), {}, {}});
    set_motion(motions, motion);
    const gpu::Buffer base = pipeline::upload_camera(*device(), camera, r.config(), origin);
    r.run([&](gpu::Recording& recording) {
        const auto use = record_move_camera({recording, r.cache}, motions, kOwn,
                                            {.buffer = &base, .width = 61, .height = 47});
        EXPECT_EQ(use.buffer, &motions.camera);
        EXPECT_EQ(use.width, 61u);
        EXPECT_EQ(use.height, 47u);
    });
    return motions.camera.download<shared::CameraBlock>(1)[0];
}

/// A camera that moves during its readout, and what three cameras with readouts have learned.
shared::CameraBlock rolling_block(const Camera& camera, const CameraMotion& motion) {
    Rig& r = rig();
    pipeline::Motions motions(*device(), {bases(), bases(), {true, true, true}});
    std::vector<float> values(2 * shared::MOTION_FLOATS * kCameras, 0.25f);
    for (const auto& [index, turn, shift] : {std::tuple{kOwn, motion.rotation, motion.shift},
                                             {kCameras + kOwn, motion.readout_turn, motion.readout_shift}}) {
        float* own = &values[shared::MOTION_FLOATS * index];
        for (int k = 0; k < 3; ++k) {
            own[k] = float(turn[k]);
            own[4 + k] = float(shift[k]);
        }
        own[3] = 0;
    }
    motions.values.upload(std::span<const float>(values));
    EXPECT_EQ(motions.download()[kOwn], motion);
    const gpu::Buffer base = pipeline::upload_camera(*device(), camera, r.config(), {});
    r.run([&](gpu::Recording& recording) {
        const auto use =
            record_move_camera({recording, r.cache}, motions, kOwn, pipeline::use_of(base, 0, camera));
        EXPECT_EQ(use.lenses, shared::LENSES_ROLLING);
    });
    return motions.camera.download<shared::CameraBlock>(1)[0];
}

/// The values of a motion as float32, which the device stores.
CameraMotion rounded(CameraMotion m) {
    for (int k = 0; k < 3; ++k) {
        m.rotation[k] = float(m.rotation[k]);
        m.shift[k] = float(m.shift[k]);
    }
    for (int k = 0; k < 3; ++k) {
        m.readout_turn[k] = float(m.readout_turn[k]);
        m.readout_shift[k] = float(m.readout_shift[k]);
    }
    m.log_focal = float(m.log_focal);
    return m;
}

TEST(MoveCamera, AMotionOfZeroGivesTheCameraItself) {
    const Camera camera = random_camera(81, 61, 47);
    const glm::dvec3 origin(1e5, -3e5, 7);
    const shared::CameraBlock still = block_of(camera, {}, origin);
    const shared::CameraBlock given = pipeline::camera_block(camera, rig().config(), origin);
    EXPECT_EQ(std::memcmp(&still, &given, sizeof(given)), 0);
}

TEST(MoveCamera, MatchesTheReferenceBeyondFloat32) {
    Random random(82);
    for (const double size : {1e-6, 1e-3, 0.02, 0.5, 2.0}) {
        SCOPED_TRACE(size);
        const Camera camera = random_camera(uint64_t(1e6 * size), 61, 47);
        CameraMotion motion;
        for (int k = 0; k < 3; ++k) {
            motion.rotation[k] = size * random.uniform(-0.5, 0.5);
            motion.shift[k] = size * random.normal();
        }
        motion.log_focal = 0.3 * size;
        motion = rounded(motion);
        const glm::dvec3 origin(100, -20, 7);
        const shared::CameraBlock is = block_of(camera, motion, origin);
        const shared::CameraBlock want =
            pipeline::camera_block(moved(camera, motion), rig().config(), origin);
        const auto near = [&](double high, double low, double want_high, double want_low, double bound) {
            EXPECT_NEAR(high + low, want_high + want_low, bound);
        };
        for (int i = 0; i < 9; ++i)
            near(is.rotation_hi[i], is.rotation_lo[i], want.rotation_hi[i], want.rotation_lo[i],
                 3e-7 * size + 1e-13);
        for (int i = 0; i < 3; ++i)
            near(is.position_hi[i], is.position_lo[i], want.position_hi[i], want.position_lo[i],
                 1e-6 * size + 1e-11);
        for (int i = 0; i < 2; ++i) {
            near(is.focal_hi[i], is.focal_lo[i], want.focal_hi[i], want.focal_lo[i], 3e-7 * camera.fx);
            EXPECT_EQ(is.center_hi[i], want.center_hi[i]);
            EXPECT_NEAR(is.tan_min[i], want.tan_min[i], 1e-6 * std::abs(want.tan_min[i]));
            EXPECT_NEAR(is.tan_max[i], want.tan_max[i], 1e-6 * std::abs(want.tan_max[i]));
            EXPECT_EQ(is.size[i], want.size[i]);
            EXPECT_EQ(is.tiles[i], want.tiles[i]);
        }
    }
}

TEST(MoveCamera, MovesTheReadoutAsTheReferenceDoes) {
    for (const auto& [name, camera] : rolling_cameras(8300, 61, 47))
        for (const double more : {0.0, 0.1, 3.0}) {  // the last one turns further than a readout may
            SCOPED_TRACE(name + " " + std::to_string(more));
            const CameraMotion motion = rounded({{0.03, -0.02, 0.04},
                                                 0,
                                                 {0.2, -0.1, 0.3},
                                                 more * glm::dvec3(0.5, -1, 0.3),
                                                 more * glm::dvec3(-0.3, 0.6, 0.2)});
            const shared::CameraBlock is = rolling_block(camera, motion);
            const shared::CameraBlock want =
                pipeline::camera_block(moved(camera, motion), rig().config(), {});
            for (int i = 0; i < 9; ++i) EXPECT_NEAR(is.rotation_hi[i], want.rotation_hi[i], 1e-6);
            for (int i = 0; i < 3; ++i) {
                EXPECT_NEAR(is.position_hi[i], want.position_hi[i], 2e-6);
                EXPECT_NEAR(is.readout_turn[i], want.readout_turn[i], 1e-6);
                EXPECT_NEAR(is.readout_shift[i], want.readout_shift[i], 1e-6);
            }
            for (int i = 0; i < 2; ++i) EXPECT_EQ(is.readout_slope[i], want.readout_slope[i]);
            EXPECT_EQ(is.readout_first, want.readout_first);
        }
    Camera still = random_camera(8301, 61, 47);
    still.readout = Readout{ReadoutFrom::left, still.rotation, still.translation};
    const shared::CameraBlock is = rolling_block(still, {.readout_turn = {0.25, 0, 0}});
    EXPECT_EQ(is.readout_turn[0], 0.25f);
    EXPECT_GT(is.readout_slope[0], 0);
}

/// motion_backward is the chain rule: central differences of a function of the moved camera.
TEST(ReferenceMotion, BackwardIsTheSlopeOfAFunctionOfTheMovedCamera) {
    const Camera camera = random_camera(83, 61, 47);
    CameraMotion at{{0.3, -0.2, 0.4}, 0.1, {0.5, 0.2, -0.3}};
    const glm::dvec3 weights[2] = {{1, -2, 3}, {0.5, 4, -1}};
    const auto f = [&](const Camera& c) {
        return glm::dot(weights[0], c.rotation * glm::dvec3(0.3, 0.7, -0.4)) +
               glm::dot(weights[1], c.position());
    };
    const auto slope = [&](const auto& moved_by, double& value) {
        const double start = value, step = 1e-6;
        value = start + step;
        const double up = f(moved_by());
        value = start - step;
        const double down = f(moved_by());
        value = start;
        return (up - down) / (2 * step);
    };
    const Camera there = moved(camera, at);
    CameraMotion after, by_after;
    const auto follow = [&] { return moved(there, after); };
    for (int k = 0; k < 3; ++k) {
        by_after.rotation[k] = slope(follow, after.rotation[k]);
        by_after.shift[k] = slope(follow, after.shift[k]);
    }
    const CameraMotion by = reference::motion_backward(at, by_after);
    const auto direct = [&] { return moved(camera, at); };
    for (int k = 0; k < 3; ++k) {
        EXPECT_NEAR(by.rotation[k], slope(direct, at.rotation[k]), 1e-7);
        EXPECT_NEAR(by.shift[k], slope(direct, at.shift[k]), 1e-7);
    }
}

constexpr double kMotionPull = 1e-2, kExtent = 3, kBeta1 = 0.5, kBeta2 = 0.9;
constexpr float kMotionRate = 1e-3f;

void update(pipeline::Motions& motions, pipeline::FrameBuffers& frame, const std::vector<float>& sums,
            uint32_t visit, uint32_t instances = 0) {
    Rig& r = rig();
    frame.motion_sums.upload(std::span<const float>(sums));
    shared::Counts counts{};
    counts.instances = instances;
    frame.counts.upload(std::span<const shared::Counts>(&counts, 1));
    r.run([&](gpu::Recording& recording) {
        record_motion_sums({recording, r.cache}, frame, motions.has_readout(kOwn));
        record_motion_update({recording, r.cache}, frame,
                             {.motions = &motions,
                              .photo = kOwn,
                              .rate = kMotionRate,
                              .extent = float(kExtent),
                              .visit = visit});
    });
}

pipeline::FrameRequest request_for(uint32_t splats) {
    return {.splats = splats, .width = 16, .height = 16, .instances = 1, .gradients = true, .motion = true};
}

std::vector<float> random_sums(const pipeline::FrameBuffers& frame, Random& random) {
    std::vector<float> sums(size_t(kMotionFloats) * frame.sizes.motion_items);
    for (float& sum : sums) sum = float(random.normal());
    return sums;
}

TEST(MotionUpdate, FollowsTheReferencesAdam) {
    for (const uint32_t splats : {1u, 5000u, 100000u}) {
        SCOPED_TRACE(splats);
        GuardedFrame guarded(rig().config(), request_for(splats));
        pipeline::FrameBuffers& frame = guarded.frame;
        pipeline::Motions motions(*device(), {bases(), {}, {}});
        // The factor of the focal length is so large that its pull exceeds the tolerance.
        CameraMotion motion = rounded({{0.03, -0.02, 0.04}, 1.5, {0.2, -0.1, 0.3}});
        set_motion(motions, motion);
        Random random(84);
        std::array<double, kMotionFloats> first{}, second{};
        const MotionBasis basis = bases()[kOwn];
        for (uint32_t visit = 1; visit <= 3; ++visit) {
            const std::vector<float> sums = random_sums(frame, random);
            std::array<double, kMotionFloats> row{};
            for (size_t i = 0; i < sums.size(); ++i) row[i / frame.sizes.motion_items] += sums[i];
            CameraMotion by = reference::motion_backward(
                motion, {{row[0], row[1], row[2]}, row[3], {row[4], row[5], row[6]}});
            by.rotation += kMotionPull * motion.rotation;
            by.shift += kMotionPull / (kExtent * kExtent) * motion.shift;
            by.log_focal += kMotionPull * motion.log_focal;
            const std::array<double*, kMotionFloats> values{
                &motion.rotation.x, &motion.rotation.y, &motion.rotation.z, &motion.log_focal,
                &motion.shift.x,    &motion.shift.y,    &motion.shift.z};
            const std::array<double, kMotionFloats> gradient{by.rotation.x, by.rotation.y, by.rotation.z,
                                                             by.log_focal,  by.shift.x,    by.shift.y,
                                                             by.shift.z};
            std::array<double, kMotionFloats> in_basis{};
            for (size_t i = 0; i < kMotionFloats; ++i)
                for (size_t j = 0; j < kMotionFloats; ++j)
                    in_basis[j] += double(basis[kMotionFloats * i + j]) * gradient[i];
            for (size_t j = 0; j < kMotionFloats; ++j) {
                first[j] = kBeta1 * first[j] + (1 - kBeta1) * in_basis[j];
                second[j] = kBeta2 * second[j] + (1 - kBeta2) * in_basis[j] * in_basis[j];
                const double m = first[j] / (1 - std::pow(kBeta1, visit));
                const double v = second[j] / (1 - std::pow(kBeta2, visit));
                for (size_t i = 0; i < kMotionFloats; ++i)
                    *values[i] -= double(basis[kMotionFloats * i + j]) * kMotionRate * m / std::sqrt(v);
            }
            update(motions, frame, sums, visit);
            EXPECT_TRUE(guarded.intact());
            const auto now = motions.download();
            for (int k = 0; k < 3; ++k) {
                EXPECT_NEAR(now[kOwn].rotation[k], motion.rotation[k], 1e-2 * kMotionRate);
                EXPECT_NEAR(now[kOwn].shift[k], motion.shift[k], 1e-2 * kMotionRate);
            }
            EXPECT_NEAR(now[kOwn].log_focal, motion.log_focal, 1e-2 * kMotionRate);
            for (const size_t other : {0u, 2u})
                EXPECT_EQ(now[other], (CameraMotion{glm::dvec3(0.25), 0.25, glm::dvec3(0.25)}));
        }
        // The moments tell the gradient itself, where a step of Adam says little more than its sign.
        const auto m = motions.moments1.download<float>(shared::MOTION_FLOATS * kCameras);
        const float* own = &m[shared::MOTION_FLOATS * kOwn];
        for (size_t k = 0; k < kMotionFloats; ++k)
            EXPECT_NEAR(own[k], first[k], 1e-4 * std::abs(first[k]) + 1e-3) << k;
    }
}

/// How far the coordinate j of the basis moves the points that the camera sees: the root mean square, in focal lengths.
double move_along(const MotionBasis& basis, size_t j, const Camera& camera, const Gaussians& gaussians) {
    const double h = 1e-5, limit = scene::lens_limit(camera);
    const auto value = [&](size_t i) { return h * double(basis[kMotionFloats * i + j]); };
    const Camera there =
        moved(camera, {{value(0), value(1), value(2)}, value(3), {value(4), value(5), value(6)}});
    double square = 0;
    size_t points = 0;
    for (size_t i = 0; i < gaussians.size(); ++i) {
        const auto pixel = [&](const Camera& c) {
            return scene::pixel_of(c, limit, c.rotation * gaussians.world_mean(i) + c.translation);
        };
        const auto at = pixel(camera), after = pixel(there);
        if (!at || !after) continue;
        if (!(at->x >= 0 && at->x < camera.width && at->y >= 0 && at->y < camera.height)) continue;
        if (std::abs(after->x - at->x) > 0.5 * camera.width) continue;  // across the seam of 360 degrees
        const glm::dvec2 by = (*after - *at) / h / glm::dvec2(camera.fx, camera.fy);
        square += glm::dot(by, by);
        ++points;
    }
    EXPECT_GT(points, 50u);
    return std::sqrt(square / double(points));
}

/// In the basis, every coordinate moves the points of the image equally far.
TEST(MotionBasis, MovesTheImageEquallyAlongEachCoordinate) {
    const Camera camera = random_camera(87, 61, 47);
    const Gaussians gaussians = random_gaussians(88, 500, SplatKind::ordinary, camera, 0);
    for (const bool focal : {false, true}) {
        const MotionBasis basis = pipeline::motion_basis(camera, gaussians, focal, 2);
        // The damping takes away a little, and more where the points say little.
        for (size_t j = 0; j < kMotionFloats; ++j)
            EXPECT_NEAR(move_along(basis, j, camera, gaussians), !focal && j == 3 ? 0 : 0.9, 0.15) << j;
    }
    for (const float value : pipeline::motion_basis(camera, Gaussians(), true, 2))
        EXPECT_TRUE(std::isfinite(value));
}

/// Of a camera at rest, whose points move by their time.
TEST(MotionBasis, OfAReadoutMovesTheImageEquallyToo) {
    Camera camera = random_camera(5400, 61, 47);
    const Gaussians gaussians = random_gaussians(5401, 500, SplatKind::ordinary, camera, 0);
    camera.readout = Readout{ReadoutFrom::bottom, camera.rotation, camera.translation};
    const MotionBasis basis = pipeline::readout_basis(camera, gaussians, 2);
    const double h = 1e-5;
    for (size_t j = 0; j < kMotionFloats; ++j) {
        const auto value = [&](size_t i) { return h * double(basis[kMotionFloats * i + j]); };
        double square = 0;
        size_t points = 0;
        for (size_t i = 0; i < gaussians.size(); ++i) {
            const auto pixel = [&](const Camera& c) {
                return scene::pixel_of(c, scene::lens_limit(c),
                                       c.rotation * gaussians.world_mean(i) + c.translation);
            };
            const auto at = pixel(camera);
            if (!at || !(at->x >= 0 && at->x < camera.width && at->y >= 0 && at->y < camera.height)) continue;
            const double time = 0.5 - at->y / camera.height;  // from the bottom
            Camera still = camera;
            still.readout.reset();
            const auto after = pixel(moved(still, {time * glm::dvec3(value(0), value(1), value(2)), 0,
                                                   time * glm::dvec3(value(4), value(5), value(6))}));
            if (!after) continue;
            const glm::dvec2 by = (*after - *at) / h / glm::dvec2(camera.fx, camera.fy);
            square += glm::dot(by, by);
            ++points;
        }
        EXPECT_GT(points, 50u);
        EXPECT_NEAR(std::sqrt(square / double(points)), j == 3 ? 0 : 0.9, 0.15) << j;
    }
}

TEST(MotionBasis, MovesTheImageOfALensEquallyToo) {
    for (const NamedCamera& lens : random_lenses(5300, 61, 47)) {
        SCOPED_TRACE(lens.name);
        const Gaussians gaussians = gaussians_around(5301, 500, lens.camera, 0);
        const MotionBasis basis = pipeline::motion_basis(lens.camera, gaussians, false, 2);
        for (size_t j = 0; j < kMotionFloats; ++j) {
            // Parallel rays show nothing of a shift along them.
            const bool unseen = lens.camera.distortion.lens == Lens::orthographic && j == 6;
            EXPECT_NEAR(move_along(basis, j, lens.camera, gaussians), j == 3 || unseen ? 0 : 0.9, 0.2) << j;
        }
    }
}

/// Its sums are the rows after those of the pose, and are the gradient by the values themselves.
TEST(MotionUpdate, OfAReadoutFollowsItsOwnSums) {
    auto request = request_for(5000);
    request.readouts = true;
    GuardedFrame guarded(rig().config(), request);
    pipeline::FrameBuffers& frame = guarded.frame;
    pipeline::Motions motions(*device(), {bases(), bases(), {false, true, false}});
    std::vector<float> values(2 * shared::MOTION_FLOATS * kCameras, 0.25f);
    motions.values.upload(std::span<const float>(values));
    Random random(89);
    std::vector<float> sums(size_t(shared::READOUT_MOTION_VALUES) * frame.sizes.motion_items);
    for (float& sum : sums) sum = float(random.normal());
    std::array<double, shared::READOUT_MOTION_VALUES> row{};
    for (size_t i = 0; i < sums.size(); ++i) row[i / frame.sizes.motion_items] += sums[i];
    update(motions, frame, sums, 1);
    EXPECT_TRUE(guarded.intact());
    const auto first = motions.moments1.download<float>(2 * shared::MOTION_FLOATS * kCameras);
    const auto now = motions.values.download<float>(2 * shared::MOTION_FLOATS * kCameras);
    const MotionBasis basis = bases()[kOwn];
    const size_t own = shared::MOTION_FLOATS * (kCameras + kOwn);
    std::array<double, kMotionFloats> expected;
    expected.fill(0.25);
    for (size_t j = 0; j < kMotionFloats; ++j) {
        double gradient = 0;
        for (size_t i = 0; i < kMotionFloats; ++i) {
            const double pull = kMotionPull / (i < 4 ? 1 : kExtent * kExtent);
            gradient += double(basis[kMotionFloats * i + j]) * (row[kMotionFloats + i] + 0.25 * pull);
        }
        EXPECT_NEAR(first[own + j], (1 - kBeta1) * gradient, 1e-4 * std::abs(gradient) + 1e-3) << j;
        // Adam's first step along each coordinate.
        for (size_t i = 0; i < kMotionFloats; ++i)
            expected[i] -=
                double(kMotionRate) * double(basis[kMotionFloats * i + j]) * (gradient > 0 ? 1 : -1);
    }
    for (size_t j = 0; j < kMotionFloats; ++j) {
        EXPECT_NEAR(now[own + j], expected[j], 1e-5) << j;
        EXPECT_NE(now[shared::MOTION_FLOATS * kOwn + j], 0.25f);  // the pose has its own step
    }
    for (const size_t other : {0u, 2u, 3u, 5u})
        for (size_t j = 0; j < kMotionFloats; ++j) EXPECT_EQ(now[shared::MOTION_FLOATS * other + j], 0.25f);
}

TEST(MotionUpdate, AStepThatIsNotFiniteIsDroppedAndCounted) {
    GuardedFrame guarded(rig().config(), request_for(100));
    pipeline::Motions motions(*device(), {bases(), {}, {}});
    Random random(85);
    std::vector<float> sums = random_sums(guarded.frame, random);
    sums[2] = std::numeric_limits<float>::infinity();
    update(motions, guarded.frame, sums, 1);
    EXPECT_EQ(guarded.frame.read_counts().dropped_updates, 1u);
    for (const CameraMotion& motion : motions.download()) EXPECT_EQ(motion, CameraMotion());
}

TEST(MotionUpdate, NothingMovesWhereTheInstancesDidNotFit) {
    GuardedFrame guarded(rig().config(), request_for(100));
    pipeline::Motions motions(*device(), {bases(), {}, {}});
    Random random(86);
    const std::vector<float> sums = random_sums(guarded.frame, random);
    update(motions, guarded.frame, sums, 1, guarded.frame.instance_capacity + 1);
    EXPECT_EQ(motions.download()[kOwn], CameraMotion());
    update(motions, guarded.frame, sums, 1, guarded.frame.instance_capacity);  // they just fit
    EXPECT_NE(motions.download()[kOwn], CameraMotion());
}

}  // namespace
}  // namespace ewa::test
