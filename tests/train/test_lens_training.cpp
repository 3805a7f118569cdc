// SPDX-License-Identifier: Apache-2.0
// Training through lenses.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

#include "ewa/trainer.h"
#include "gpu/test_device.h"
#include "shared/constants.h"
#include "train/synthetic.h"

namespace ewa::test {
namespace {

/// The largest scale of a splat that the camera sees, over its distance from the camera. The picture of such a splat in the middle
/// of a pinhole's image lies within it.
double widest(const Gaussians& gaussians, const Camera& camera) {
    double most = 0;
    for (size_t i = 0; i < gaussians.size(); ++i) {
        const double distance = glm::length(gaussians.world_mean(i) - camera.position());
        for (size_t k = 0; k < 3; ++k)
            most = std::max(most, std::exp(double(gaussians.log_scales[3 * i + k])) / distance);
    }
    return most;
}

TEST(LensTraining, SplatsStayNarrowAsSeenFromTheCameras) {
    for (const Lens lens : {Lens::fisheye, Lens::equirectangular, Lens::brown})
        for (const int batch : {1, 2}) {
            Synthetic scene;
            put_lens(scene, {.k1 = lens == Lens::brown ? 0.01 : 0, .lens = lens});
            Gaussians start = scene.truth;
            for (float& scale : start.log_scales)
                scale = std::log(2.0f);  // half of the distance to the cameras
            TrainOptions options = quick(60);
            options.strategy = Strategy::none;
            options.batch = batch;
            Trainer trainer(device(), scene.dataset, {0, 3}, start, options);
            trainer.step();
            if (batch == 1) trainer.step();  // both cameras have been drawn
            const double most = std::max(widest(trainer.gaussians(), scene.dataset.frames[0].camera),
                                         widest(trainer.gaussians(), scene.dataset.frames[3].camera));
            if (lens == Lens::brown)
                EXPECT_GT(most, 0.4) << "a perspective image itself keeps splats within it";
            else
                EXPECT_LT(most, 1.1 * shared::WIDEST_SHARE) << int(lens) << ", batch " << batch;
        }
}

}  // namespace
}  // namespace ewa::test
