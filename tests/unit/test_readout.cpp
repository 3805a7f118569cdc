// SPDX-License-Identifier: Apache-2.0
// Rolling shutters: when a pixel is read, and where the camera is then.
#include <gtest/gtest.h>

#include <algorithm>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>

#include "ewa/camera_motion.h"
#include "ewa/error.h"
#include "reference/readout.h"
#include "scene/readout.h"
#include "shared/constants.h"
#include "support/random_lens.h"
#include "support/random_scene.h"

namespace ewa::test {
namespace {

double farthest(const glm::dmat3& a, const glm::dmat3& b) {
    double most = 0;
    for (int i = 0; i < 3; ++i) most = std::max(most, glm::length(a[i] - b[i]));
    return most;
}

/// world_ray and the projection of splats share no code but the poses.
TEST(Readout, APixelSeesThePointsThatItShows) {
    for (const auto& [name, camera] : rolling_cameras(7200, 97, 61)) {
        SCOPED_TRACE(name);
        Random random(7201);
        int blind = 0;
        for (int i = 0; i < 200; ++i) {
            const double x = random.uniform(0, 97), y = random.uniform(0, 61);
            const auto ray = scene::world_ray(camera, scene::lens_limit(camera), x, y);
            blind += !ray;
            if (!ray) continue;
            reference::LensImage image;
            const reference::ReadoutImage readout =
                reference::readout_image(camera, ray->origin + random.uniform(2, 9) * ray->direction, image);
            ASSERT_TRUE(image.shown);
            EXPECT_NEAR(image.pixel.x, x, 1e-6);
            EXPECT_NEAR(image.pixel.y, y, 1e-6);
            const double along = camera.readout->from == ReadoutFrom::top      ? y / 61
                                 : camera.readout->from == ReadoutFrom::bottom ? 1 - y / 61
                                 : camera.readout->from == ReadoutFrom::left   ? x / 97
                                                                               : 1 - x / 97;
            EXPECT_NEAR(readout.share, along, 1e-7);
        }
        EXPECT_LT(blind, name.starts_with("fisheye") ? 60 : 1);
    }
}

TEST(Readout, GoesFromOnePoseToTheOther) {
    for (const auto& [name, camera] : rolling_cameras(7300, 97, 61)) {
        SCOPED_TRACE(name);
        const Camera first = scene::at_share(camera, 0), last = scene::at_share(camera, 1),
                     middle = scene::at_middle(camera);
        EXPECT_FALSE(first.readout);
        EXPECT_LT(farthest(first.rotation, camera.rotation), 1e-14);
        EXPECT_LT(farthest(last.rotation, camera.readout->rotation), 1e-14);
        EXPECT_LT(glm::length(last.translation - camera.readout->translation), 1e-13);
        EXPECT_LT(glm::length(middle.position() - 0.5 * (first.position() + last.position())), 1e-13);
        // The middle is as far from both.
        EXPECT_LT(farthest(middle.rotation * glm::transpose(first.rotation),
                           last.rotation * glm::transpose(middle.rotation)),
                  1e-13);
        const scene::ReadoutMotion motion = scene::readout_motion(camera);
        Camera again = middle;
        scene::add_readout(again, camera.readout->from, motion.turn,
                           glm::transpose(camera.rotation) * motion.shift);
        EXPECT_LT(farthest(again.rotation, camera.rotation), 1e-13);
        EXPECT_LT(farthest(again.readout->rotation, camera.readout->rotation), 1e-13);
        EXPECT_LT(glm::length(again.position() - camera.position()), 1e-13);
    }
}

TEST(Readout, IsMovedWithItsCamera) {
    for (const auto& [name, camera] : rolling_cameras(7500, 97, 61)) {
        SCOPED_TRACE(name);
        const CameraMotion motion{
            {0.02, -0.03, 0.01}, 0, {0.1, 0.2, -0.3}, {0.04, 0.01, -0.02}, {0.3, 0, 0.1}};
        const Camera after = moved(camera, motion);
        // The pose in the middle moves as that of a global shutter.
        const Camera middle = moved(scene::at_middle(camera), motion);
        EXPECT_LT(farthest(scene::at_middle(after).rotation, middle.rotation), 1e-13);
        EXPECT_LT(glm::length(scene::at_middle(after).position() - middle.position()), 1e-13);
        const scene::ReadoutMotion from = scene::middle_motion(camera), to = scene::middle_motion(after);
        EXPECT_LT(glm::length(to.turn - from.turn - motion.readout_turn), 1e-13);
        EXPECT_LT(glm::length(to.shift - from.shift - motion.readout_shift), 1e-13);
        EXPECT_EQ(after.readout->from, camera.readout->from);
        const CameraDistance distance = distance_between(camera, after);
        EXPECT_NEAR(distance.length, glm::length(motion.shift), 1e-13);
        // Without a motion of the readout, both ends keep theirs.
        const Camera same = moved(camera, {{0.02, -0.03, 0.01}, 0, {0.1, 0.2, -0.3}, {}, {}});
        EXPECT_LT(glm::length(scene::middle_motion(same).shift - from.shift), 1e-13);
        // No readout turns further than splats are drawn for.
        const Camera most = moved(camera, {.readout_turn = {9, 0, 0}});
        EXPECT_NEAR(glm::length(scene::readout_motion(most).turn), shared::READOUT_TURN_LEARNED, 1e-9);
        EXPECT_NO_THROW(scene::check_readout(most));
    }
}

TEST(Readout, OfACameraAtRestIsNone) {
    Camera camera = random_camera(7400);
    EXPECT_FALSE(scene::moves(camera));
    camera.readout = Readout{ReadoutFrom::top, camera.rotation, camera.translation};
    EXPECT_FALSE(scene::moves(camera));
    camera.distortion.lens = Lens::equirectangular;
    EXPECT_NO_THROW(scene::check_readout(camera));
    camera.readout->translation.x += 1;
    EXPECT_TRUE(scene::moves(camera));
    EXPECT_THROW(scene::check_readout(camera), InputError);
}

}  // namespace
}  // namespace ewa::test
