// SPDX-License-Identifier: Apache-2.0
// A dataset made in the test: splats at known places, rendered by the CPU reference.
#pragma once
#include <cmath>
#include <filesystem>
#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>
#include <numeric>
#include <string>
#include <vector>

#include "ewa/dataset.h"
#include "ewa/train_options.h"
#include "reference/render.h"
#include "scene/native_lens.h"
#include "support/random_scene.h"
#include "support/temp_folder.h"

namespace ewa::test {

struct Synthetic {
    TempFolder folder;
    Gaussians truth;
    Dataset dataset;
};

/// `views` cameras on a ring round the origin that look at it, and `splats` splats within a unit of it.
inline void make_synthetic(Synthetic& out, size_t splats, int views, int width, int height, uint64_t seed) {
    Random random(seed);
    out.truth.resize(splats);
    for (size_t i = 0; i < splats; ++i) {
        for (size_t k = 0; k < 3; ++k) {
            out.truth.means[3 * i + k] = float(random.uniform(-1, 1));
            out.truth.log_scales[3 * i + k] = float(std::log(random.uniform(0.08, 0.3)));
            out.truth.sh[3 * i + k] = float(random.uniform(-1.7, 1.7));
        }
        for (size_t k = 0; k < 4; ++k) out.truth.quaternions[4 * i + k] = float(random.normal());
        out.truth.opacity_logits[i] = float(random.uniform(0.5, 3));
    }
    std::string images, points;
    for (int view = 0; view < views; ++view) {
        const double angle = 2 * 3.14159265358979 * view / views;
        const glm::dvec3 position(4 * std::cos(angle), 0.8 * std::sin(2 * angle), 4 * std::sin(angle));
        const glm::dvec3 forward = glm::normalize(-position);
        const glm::dvec3 right = glm::normalize(glm::cross(forward, glm::dvec3(0, 1, 0)));
        const glm::dvec3 down = glm::cross(forward, right);
        Camera camera;
        camera.width = width;
        camera.height = height;
        camera.fx = camera.fy = 1.1 * width;
        camera.cx = 0.5 * width;
        camera.cy = 0.5 * height;
        camera.rotation = glm::transpose(glm::dmat3(right, down, forward));
        camera.translation = -(camera.rotation * position);
        const auto render = reference::render(out.truth, camera, {});
        Image picture(width, height, 3);
        for (size_t i = 0; i < picture.pixels.size(); ++i)
            picture.pixels[i] = float(render.blended.color.values[i]);
        const std::string name = "view_" + std::to_string(100 + view) + ".png";
        std::filesystem::create_directories(out.folder / "images");
        save_image(out.folder / "images" / name, picture);
        const glm::dquat q = glm::quat_cast(camera.rotation);
        const auto number = [](double x) {
            char text[40];
            std::snprintf(text, sizeof(text), " %.17g", x);
            return std::string(text);
        };
        images += std::to_string(view + 1) + number(q.w) + number(q.x) + number(q.y) + number(q.z) +
                  number(camera.translation.x) + number(camera.translation.y) + number(camera.translation.z) +
                  " 1 " + name + "\n\n";
    }
    for (size_t i = 0; i < splats; ++i)
        points += std::to_string(i + 1) + " " + std::to_string(out.truth.means[3 * i]) + " " +
                  std::to_string(out.truth.means[3 * i + 1]) + " " +
                  std::to_string(out.truth.means[3 * i + 2]) + " 128 128 128 0.5\n";
    const std::string size = std::to_string(width) + " " + std::to_string(height);
    out.folder.write("sparse/0/cameras.txt", "1 PINHOLE " + size + " " + std::to_string(1.1 * width) + " " +
                                                 std::to_string(1.1 * width) + " " +
                                                 std::to_string(0.5 * width) + " " +
                                                 std::to_string(0.5 * height) + "\n");
    out.folder.write("sparse/0/images.txt", images);
    out.folder.write("sparse/0/points3D.txt", points);
    out.dataset = load_dataset(out.folder.path(), {});
}

/// One small capture, made once for all the tests of a program: 40 splats, 8 views of 48x36.
inline const Synthetic& small_capture() {
    static const Synthetic* made = [] {
        static Synthetic synthetic;
        make_synthetic(synthetic, 40, 8, 48, 36, 7);
        return &synthetic;
    }();
    return *made;
}

/// Gives the frame the image that its changed camera has of the truth.
inline void draw_truth(const Synthetic& out, Frame& frame) {
    frame.pinhole = frame.source = frame.camera;
    frame.image_path = out.folder / frame.image_path.filename().string();
    const auto render = reference::render(out.truth, frame.camera, {});
    Image picture(frame.camera.width, frame.camera.height, 3);
    for (size_t i = 0; i < picture.pixels.size(); ++i)
        picture.pixels[i] = float(render.blended.color.values[i]);
    save_image(frame.image_path, picture);
}

/// Cameras at the places of small_capture's, and their images through a lens.
inline void put_lens(Synthetic& out, const Distortion& lens) {
    out.truth = small_capture().truth;
    out.dataset = small_capture().dataset;
    for (Frame& frame : out.dataset.frames) {
        frame.camera = scene::through_lens(frame.camera, lens, 70, glm::dvec3(0));
        if (lens.lens == Lens::equirectangular) {
            frame.camera.width = 96;
            scene::set_equirectangular(frame.camera);
        }
        draw_truth(out, frame);
    }
}

inline std::vector<int> all_frames(const Dataset& dataset) {
    std::vector<int> frames(dataset.frames.size());
    std::iota(frames.begin(), frames.end(), 0);
    return frames;
}

/// A start some way from the truth: grey splats at points shaken by `shake` world units.
inline Gaussians shaken_start(const Synthetic& data, double shake, uint64_t seed, int sh_degree) {
    Random random(seed);
    PointCloud points = data.dataset.points;
    for (glm::dvec3& p : points.positions)
        for (int k = 0; k < 3; ++k) p[k] += shake * random.normal();
    return gaussians_from_points(points, sh_degree);
}

/// Options of a run that ends after a few hundred steps.
inline TrainOptions quick(int steps) {
    TrainOptions options;
    options.steps = steps;
    options.sh_degree = 0;
    options.strategy = Strategy::none;
    options.seed = 3;
    // Such a run has to take longer steps than a run of 30,000.
    options.short_run_power = 0;
    options.few_photos = 0;
    options.means_rate = 6e-3;
    options.means_rate_final = 4e-4;
    options.sh_rest_rate = 2.5e-4;
    options.sh0_rate = 0.05;
    options.opacity_rate = 0.05;
    options.scale_rate = 0.03;
    options.quaternion_rate = 0.03;
    return options;
}

/// Options with which a run densifies, resets and relocates within some tens of steps.
inline TrainOptions busy(Strategy strategy, int batch) {
    TrainOptions options;
    options.steps = 60;
    options.batch = batch;
    options.strategy = strategy;
    options.seed = 3;
    options.sh_degree = 1;
    options.max_splats = 900;
    options.grow_gradient = 1e-5;
    options.refine_start = 10;
    options.refine_every = 20;
    options.refine_stop = 30000;
    options.relocate_stop = 30000;
    options.dead_opacity = 0.09;
    options.growth = 1.2;
    options.opacity_reset_every = 50;
    options.short_run_power = 0;
    options.few_photos = 0;
    options.means_rate = 3e-3;
    options.opacity_rate = 0.3;
    return options;
}

/// Seven small images of 300 splats, made once.
inline const Synthetic& seven_views() {
    static const Synthetic* const made = [] {
        auto* data = new Synthetic;
        make_synthetic(*data, 300, 7, 64, 48, 11);
        return data;
    }();
    return *made;
}

}  // namespace ewa::test
