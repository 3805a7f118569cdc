// SPDX-License-Identifier: Apache-2.0
// What the choice of an appearance measures on the training images, and what it chooses.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <filesystem>
#include <memory>
#include <vector>

#include "ewa/error.h"
#include "ewa/run_options.h"
#include "ewa/training_needs.h"
#include "prepare/appearance_choice.h"
#include "scene/frame_images.h"
#include "support/shared_by_tests.h"
#include "train/synthetic.h"

namespace ewa::test {
namespace {

/// Eight images of one colour that differ by 2^stops, and points of the usual colour.
Dataset in_stops(Synthetic& made, const std::array<double, 8>& stops, double red = 1) {
    make_synthetic(made, 40, 8, 48, 36, 7);
    for (size_t i = 0; i < stops.size(); ++i) {
        Image image(48, 36, 3);
        for (size_t k = 0; k < image.pixels.size(); ++k)
            image.pixels[k] = float(0.4 * std::exp2(stops[i]) * (k % 3 == 0 && i % 2 == 0 ? red : 1));
        save_image(made.dataset.frames[i].image_path, image);
    }
    Dataset dataset = load_dataset(made.folder.path(), {});
    dataset.points.colors.assign(dataset.points.positions.size(), {102, 102, 102});
    return dataset;
}

/// Images of one camera that show its points, each in a pixel of its grey, times 2^stops.
Dataset textured(Synthetic& made, const std::array<double, 8>& stops) {
    Dataset dataset = in_stops(made, stops);
    const Camera camera = dataset.frames[0].camera;
    dataset.points = {};
    for (size_t i = 0; i < stops.size(); ++i) {
        Image image(48, 36, 3);
        for (int y = 0; y < 36; ++y)
            for (int x = 0; x < 48; ++x) {
                const int grey = 60 + (x * x + 5 * y * y + 3 * x * y) % 120;
                std::fill_n(image.at(x, y), 3, float(std::exp2(stops[i]) * grey / 255));
                if (i > 0) continue;
                const glm::dvec3 ray((x + 0.5 - camera.cx) / camera.fx, (y + 0.5 - camera.cy) / camera.fy, 1);
                dataset.points.positions.push_back(glm::transpose(camera.rotation) *
                                                   (2.0 * ray - camera.translation));
                dataset.points.colors.push_back({uint8_t(grey), uint8_t(grey), uint8_t(grey)});
            }
        save_image(dataset.frames[i].image_path, image);
        dataset.frames[i].camera = camera;
    }
    return dataset;
}

TEST(AppearanceChoice, LeavesItsImagesToTheTraining) {
    Synthetic made;
    Dataset dataset = in_stops(made, {});
    scene::KeptImages images = scene::read_images(dataset, train::compared_frames(all_frames(dataset)));
    ASSERT_EQ(images.size(), 8u);
    Frame& frame = dataset.frames[3];
    const std::vector<float> pixels = load_frame_image(frame).pixels;
    EXPECT_EQ(scene::image_of(frame).get(), &images[3]->image);
    EXPECT_EQ(scene::image_of(frame)->pixels, pixels);

    // A frame that is to be read in another way is read again.
    frame.downscale = 2;
    EXPECT_NE(scene::image_of(frame).get(), &images[3]->image);
    EXPECT_LT(scene::image_of(frame)->width, images[3]->image.width);
    frame.downscale = 1;
    frame.left_out = std::make_shared<const Image>(1, 1, 1);
    EXPECT_EQ(scene::image_of(frame)->channels, 4);
    frame.left_out = nullptr;
    EXPECT_EQ(scene::image_of(frame).get(), &images[3]->image);

    std::filesystem::remove(frame.image_path);
    EXPECT_EQ(scene::image_of(frame)->pixels, pixels);
    images.clear();
    EXPECT_THROW(scene::image_of(frame), InputError);
}

TEST(AppearanceChoice, KeepsNoMoreImagesThanItMay) {
    Synthetic made;
    Dataset dataset = in_stops(made, {});
    // 2^25 values of four channels are 2^23 pixels.
    for (Frame& frame : dataset.frames) frame.camera.width = frame.camera.height = 1 << 10;
    EXPECT_EQ(scene::read_images(dataset, all_frames(dataset)).size(), 8u);
    dataset.frames[5].camera.height += 1;
    const scene::KeptImages images = scene::read_images(dataset, all_frames(dataset));
    EXPECT_EQ(images.size(), 7u);
    EXPECT_NE(dataset.frames[6].kept.lock(), nullptr);
    EXPECT_EQ(dataset.frames[7].kept.lock(), nullptr);
}

TEST(AppearanceChoice, IsAModelWhereImagesDisagreeOnThePoints) {
    Synthetic made;
    const auto found = [](const Dataset& dataset) {
        return train::disagreement_of(dataset, all_frames(dataset));
    };
    const auto choice = [](const Dataset& dataset, const TrainOptions& options = {}) {
        return train::choose_appearance(options, dataset, all_frames(dataset));
    };
    const Dataset same = in_stops(made, {});
    EXPECT_EQ(found(same).images, 8);
    EXPECT_NEAR(found(same).exposure, 0, 0.01);
    EXPECT_EQ(choice(same).model, AppearanceModel::none);

    const std::array<double, 8> stops{0.3, -0.3, 0.3, -0.3, 0.3, -0.3, 0.3, -0.3};
    const Dataset brighter = in_stops(made, stops);
    EXPECT_NEAR(found(brighter).exposure, 0.3, 0.01);
    EXPECT_NEAR(found(brighter).color, 0, 0.01);
    EXPECT_EQ(choice(brighter).model, AppearanceModel::ppisp);
    EXPECT_EQ(resolve(RunOptions().train, brighter, all_frames(brighter)).appearance, AppearanceModel::ppisp);
    const std::vector<float> first = train::first_exposures(brighter, all_frames(brighter));
    for (size_t k = 0; k < stops.size(); ++k) EXPECT_NEAR(first[k], stops[k], 0.02) << k;
    TrainOptions options;
    options.bands = 2;
    EXPECT_EQ(choice(brighter, options).model, AppearanceModel::none);

    const train::Disagreement redder = found(in_stops(made, {}, 1.15));
    EXPECT_NEAR(redder.color, std::log2(1.15) / 2, 0.01);
    EXPECT_LT(redder.exposure, 0.04);
    EXPECT_EQ(choice(in_stops(made, {}, 1.15)).model, AppearanceModel::ppisp);

    // Points of one grey, or of random colours, say nothing of images.
    for (const bool random : {false, true}) {
        Dataset colorless = textured(made, stops);
        EXPECT_NEAR(found(colorless).exposure, 0.3, 0.05);
        for (size_t i = 0; i < colorless.points.colors.size(); ++i)
            colorless.points.colors[i].fill(uint8_t(random ? 60 + i * 7919 % 150 : 128));
        EXPECT_EQ(found(colorless).images, 0) << random;
    }

    Dataset pointless = brighter;
    pointless.points = {};
    EXPECT_EQ(choice(pointless).reason, "neither points nor EXIF say how the images differ");
    EXPECT_EQ(choice(pointless).model, AppearanceModel::none);
    EXPECT_EQ(train::first_exposures(pointless, {0, 1}), (std::vector<float>{0, 0}));
}

/// Half of the cameras look one way, where brighter points are behind those of the image's colour.
TEST(AppearanceChoice, DoesNotCompareHiddenPoints) {
    Synthetic made;
    Dataset dataset = in_stops(made, {});
    dataset.points = {};
    const auto add = [&](double x, double y, double z, uint8_t grey) {
        dataset.points.positions.push_back({x * z, y * z, z});
        dataset.points.colors.push_back({grey, grey, grey});
    };
    for (int k = 0; k < 100; ++k) {
        const double x = 0.02 * (k % 10 - 4.5), y = 0.02 * (k / 10 - 4.5);
        for (const double z : {-2.0, 2.0}) add(x, y, z, 102);
        for (const double z : {3.0, 4.0, 5.0}) add(x, y, z, 200);
    }
    for (size_t k = 0; k < dataset.frames.size(); ++k) {
        Camera& camera = dataset.frames[k].camera;
        const double way = k % 2 == 0 ? 1 : -1;
        camera.rotation = glm::dmat3(way, 0, 0, 0, 1, 0, 0, 0, way);
        camera.translation = {0, 0, 0};
    }
    const train::Disagreement found = train::disagreement_of(dataset, all_frames(dataset));
    EXPECT_EQ(found.images, 8);
    EXPECT_NEAR(found.exposure, 0, 0.01);
}

}  // namespace
}  // namespace ewa::test
