// SPDX-License-Identifier: Apache-2.0
// Eighty steps of training on the devices against eighty steps of the float64 CPU reference.
#include <algorithm>
#include <glm/gtc/constants.hpp>
#include <numeric>

#include "ewa/splat_edit.h"
#include "ewa/trainer.h"
#include "golden/devices.h"
#include "golden/golden.h"
#include "reference/render.h"
#include "reference/training.h"
#include "train/image_cache.h"
#include "train/schedule.h"
#include "train/synthetic.h"

namespace ewa::test {
namespace {

constexpr int kSteps = 80;

TrainOptions training_options() {
    TrainOptions options;
    options.steps = kSteps;
    options.strategy = Strategy::none;
    options.sh_degree = 1;
    options.seed = 11;
    options.render.background = {0.1f, 0.1f, 0.2f};
    // Eighty steps have to be longer ones than 30,000.
    options.short_run_power = 0;
    options.few_photos = 0;
    options.means_rate = 3e-3;
    options.means_rate_final = 1e-3;
    options.sh0_rate = 0.02;
    options.sh_rest_rate = 2e-3;
    options.opacity_rate = 0.02;
    options.scale_rate = 0.01;
    options.quaternion_rate = 0.01;
    return options;
}

/// The truth, moved a little and of another colour: not round, since the gradient of a ball's rotation is
/// rounding alone.
Gaussians training_start(const Synthetic& data) {
    Gaussians start;
    start.sh_degree = 1;
    start.resize(data.truth.size());
    Random random(21);
    const auto moved = [&](const std::vector<float>& from, std::vector<float>& to, double by) {
        for (size_t i = 0; i < from.size(); ++i) to[i] = float(from[i] + by * random.normal());
    };
    moved(data.truth.means, start.means, 0.05);
    moved(data.truth.quaternions, start.quaternions, 0.1);
    moved(data.truth.log_scales, start.log_scales, 0.2);
    moved(data.truth.opacity_logits, start.opacity_logits, 0.2);
    for (size_t i = 0; i < start.size(); ++i)
        for (size_t k = 0; k < 3; ++k) start.sh[12 * i + k] = 0.3f * data.truth.sh[3 * i + k];
    return start;
}

Camera held_out_camera(const Synthetic& data) {
    Camera camera = data.dataset.frames[0].camera;
    const glm::dmat3 turn(0.8, 0, -0.6, 0, 1, 0, 0.6, 0,
                          0.8);  // about y; the cameras of the ring stand at other angles
    camera.rotation = camera.rotation * turn;
    return camera;
}

/// One step of Adam on each kind of value, with its own rate.
struct ReferenceAdam {
    reference::AdamState means, quaternions, scales, opacities, sh0, sh_rest;

    explicit ReferenceAdam(const reference::Values& v)
        : means(v.means.size()),
          quaternions(v.quaternions.size()),
          scales(v.log_scales.size()),
          opacities(v.opacity_logits.size()),
          sh0(3 * v.size()),
          sh_rest(v.sh.size() - 3 * v.size()) {}

    void step(reference::Values& v, const reference::Values& g, const TrainOptions& options, double mean_rate,
              int step) {
        reference::adam_step(v.means, g.means, means, mean_rate, step);
        reference::adam_step(v.quaternions, g.quaternions, quaternions, options.quaternion_rate, step);
        reference::adam_step(v.log_scales, g.log_scales, scales, options.scale_rate, step);
        reference::adam_step(v.opacity_logits, g.opacity_logits, opacities, options.opacity_rate, step);
        sh_part(v, g, 0, 3, sh0, options.sh0_rate, step);
        sh_part(v, g, 3, v.sh_stride(), sh_rest, options.sh_rest_rate, step);
    }

    static void sh_part(reference::Values& v, const reference::Values& g, size_t first, size_t end,
                        reference::AdamState& state, double rate, int step) {
        std::vector<double> values, gradient;
        const auto each = [&](const auto& visit) {
            for (size_t i = 0; i < v.size(); ++i)
                for (size_t k = first; k < end; ++k) visit(i * v.sh_stride() + k);
        };
        each([&](size_t at) {
            values.push_back(v.sh[at]);
            gradient.push_back(g.sh[at]);
        });
        reference::adam_step(values, gradient, state, rate, step);
        size_t next = 0;
        each([&](size_t at) { v.sh[at] = values[next++]; });
    }
};

std::vector<int> all_frames(const Dataset& dataset) {
    std::vector<int> frames(dataset.frames.size());
    std::iota(frames.begin(), frames.end(), 0);
    return frames;
}

reference::Values train_reference(const Synthetic& data, const TrainOptions& options) {
    Gaussians start = training_start(data);
    select_splats(start, morton_order(start));  // the trainer's order, which settles ties
    reference::Values values = start;
    const train::Schedule schedule = train::schedule_for(options);
    const std::vector<int> frames = all_frames(data.dataset);
    const double extent = scene_extent(data.dataset, frames);
    ReferenceAdam adam(values);
    for (int step = 1; step <= options.steps; ++step) {
        const Frame& frame =
            data.dataset.frames[train::frame_of_step(step, uint32_t(frames.size()), options.seed)];
        RenderOptions render = options.render;
        render.sh_degree = schedule.degree(step);
        const auto expected = reference::loss_gradient(values, frame.camera, load_frame_image(frame), render);
        adam.step(values, expected.gradient, options, schedule.mean_rate(step, extent), step);
    }
    return values;
}

Image reference_image(const reference::Raster& raster) {
    Image image(raster.width, raster.height, 3);
    for (size_t i = 0; i < image.pixels.size(); ++i)
        image.pixels[i] = float(std::clamp(raster.values[i], 0.0, 1.0));
    return image;
}

TEST(GoldenTraining, EightySteps) {
    Synthetic data;
    make_synthetic(data, 40, 8, 48, 36, 7);
    const TrainOptions options = training_options();
    const Camera camera = held_out_camera(data);
    const reference::Values expected = train_reference(data, options);
    EXPECT_TRUE(
        is_reference("training_80_steps",
                     reference_image(reference::render(expected, camera, options.render).blended.color)));
    // It has moved: the start's picture is no candidate.
    const Tolerance tolerance{0.01, 2e-3, 60};
    const auto start = reference::render(training_start(data), camera, options.render);
    const Image reference = load_image(GoldenFolders{}.references / "training_80_steps.png");
    EXPECT_GT(compare_images(reference_image(start.blended.color), reference).max_error, 0.2);

    for (const auto& device : all_devices()) {
        Trainer trainer(device, data.dataset, all_frames(data.dataset), training_start(data), options);
        for (int step = 0; step < kSteps; ++step) trainer.step();
        const Gaussians trained = trainer.gaussians();
        ASSERT_EQ(trained.size(), expected.size());
        double furthest = 0;
        for (size_t i = 0; i < trained.means.size(); ++i)
            furthest = std::max(furthest, std::abs(trained.means[i] - expected.means[i]));
        printf("    furthest mean from the reference's: %.2g\n", furthest);
        EXPECT_LT(furthest, 0.01);
        Image picture = Renderer(device, trained, options.render).render(camera).color;
        for (float& v : picture.pixels) v = std::clamp(v, 0.0f, 1.0f);
        EXPECT_TRUE(matches_golden("training_80_steps", picture, tolerance, device_info(*device).name));
    }
}

}  // namespace
}  // namespace ewa::test
