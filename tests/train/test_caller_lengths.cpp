// SPDX-License-Identifier: Apache-2.0
// What a caller gives to renderers and trainers with arrays of a wrong length is an error, and the device is still of use.
#include <gtest/gtest.h>

#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "ewa/error.h"
#include "ewa/evaluation.h"
#include "ewa/trainer.h"
#include "gpu/test_device.h"
#include "support/wrong_lengths.h"
#include "train/synthetic.h"

namespace ewa::test {
namespace {

using Calls = std::vector<std::pair<std::string, std::function<void(const Gaussians&)>>>;

TEST(CallerLengths, OfSplatsAreChecked) {
    const Dataset& dataset = small_capture().dataset;
    const std::vector<int> frames = all_frames(dataset);
    const Camera& camera = dataset.frames[0].camera;
    const Image photo(camera.width, camera.height, 3);
    Renderer renderer(device(), storable_splats(3, 20, 1), {});
    const Image before = renderer.render(camera).color;
    const Calls calls{
        {"Renderer", [&](const Gaussians& g) { Renderer(device(), g, {}).render(camera); }},
        {"replace", [&](const Gaussians& g) { renderer.replace(g); }},
        {"loss_gradient", [&](const Gaussians& g) { loss_gradient(device(), g, camera, photo, {}); }},
        {"plan_lines", [](const Gaussians& g) { plan_lines(g, RenderOptions{}); }},
        {"plan_lines", [](const Gaussians& g) { plan_lines(g, TrainOptions{}); }},
        {"Trainer", [&](const Gaussians& g) { Trainer(device(), dataset, frames, g, {.steps = 10}); }},
        {"splat_cap", [&](const Gaussians& g) { splat_cap(*device(), dataset, frames, g, {}); }},
        {"estimate_memory", [&](const Gaussians& g) { estimate_memory(*device(), dataset, frames, g, {}); }},
        {"evaluate", [&](const Gaussians& g) { evaluate(device(), g, dataset, frames, {}); }}};
    for (const auto& [name, call] : calls)
        for (const auto& [wrong, part] : wrong_splats()) {
            SCOPED_TRACE(name + ": " + part);
            expect_error<InputError>([&] { call(wrong); }, {part});
        }
    // The renderer still has its scene.
    EXPECT_EQ(renderer.render(camera).color.pixels, before.pixels);
}

TEST(CallerLengths, ImagesFramesAndOptionsAreChecked) {
    const Dataset& dataset = small_capture().dataset;
    const std::vector<int> frames = all_frames(dataset), beyond{0, int(dataset.frames.size())};
    const Gaussians g = storable_splats(3, 20, 1);
    const Camera& camera = dataset.frames[0].camera;
    const auto refused = [](const std::function<void()>& call, const std::string& part) {
        expect_error<InputError>(call, {part});
    };
    Image few(camera.width, camera.height, 3);
    few.pixels.resize(7);
    refused([&] { loss_gradient(device(), g, camera, few, {}); }, "pixels has 7 values");
    const Image photo(camera.width, camera.height, 3);
    Image depths(camera.width, camera.height, 1);
    depths.pixels.resize(7);
    refused([&] { loss_gradient(device(), g, camera, photo, {}, false, {}, depths); }, "pixels has 7 values");
    refused([&] { loss_gradient(device(), g, camera, Image(camera.width, camera.height, 5), {}); }, "RGBA");

    refused([&] { Trainer(device(), dataset, beyond, g, {.steps = 10}); }, "in a dataset of");
    refused([&] { splat_cap(*device(), dataset, beyond, g, {}); }, "in a dataset of");
    refused([&] { estimate_memory(*device(), dataset, beyond, g, {}); }, "in a dataset of");
    refused([&] { resolve({}, dataset, beyond); }, "in a dataset of");
    refused([&] { evaluate(device(), g, dataset, beyond, {}); }, "in a dataset of");
    refused([&] { evaluate(device(), g, dataset, frames, {}, {kIdentityExposure}); }, "1 appearance for");

    const auto few_texels = std::make_shared<const SkyMap>(SkyMap{8, {0, 0, 0}});
    for (const auto& [options, part] :
         std::vector<std::pair<RenderOptions, std::string>>{{{.sh_degree = -1}, "SH degree"},
                                                            {{.samples = 0}, "samples"},
                                                            {{.points = true, .nearest = 0}, "spheres"},
                                                            {{.points = true, .nearest = 1 << 20}, "spheres"},
                                                            {{.sky = few_texels}, "texels has 3 values"}}) {
        refused([&, o = options] { Renderer(device(), g, o); }, part);
        refused([&, o = options] { Renderer(device(), g, {}).render(camera, DrawOptions{.render = o}); },
                part);
        refused([&, o = options] { loss_gradient(device(), g, camera, photo, o); }, part);
        refused([&, o = options] { plan_lines(g, o); }, part);
        TrainOptions training{.steps = 10};
        training.render = options;
        refused([&] { Trainer(device(), dataset, frames, g, training); }, part);
    }
    refused([&] { Trainer(device(), dataset, frames, g, {.steps = 0}); }, "--steps");
    refused([&] { Trainer(device(), dataset, frames, g, {.steps = 10, .sh_degree = 7}); }, "--sh-degree 7");
    refused([&] { Trainer(device(), dataset, frames, g, {.steps = 10, .moment_bits = 8}); }, "8 bits");
}

}  // namespace
}  // namespace ewa::test
