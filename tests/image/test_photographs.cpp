// SPDX-License-Identifier: Apache-2.0
// Images as captures have them: turned, of several sizes, deep, with smaller copies beside them.
#include <OpenImageIO/imageio.h>

#include <cmath>

#include "ewa/dataset.h"
#include "support/temp_folder.h"

namespace {

using namespace ewa;
using test::expect_error;
using test::TempFolder;

/// Grey levels that tell every pixel apart.
Image ramp(int width, int height, int channels = 3) {
    Image image(width, height, channels);
    for (size_t i = 0; i < image.pixels.size(); ++i) image.pixels[i] = float((i * 7) % 256) / 255;
    return image;
}

void write_turned(const std::filesystem::path& path, const Image& image, int orientation) {
    auto output = OIIO::ImageOutput::create(path.string());
    OIIO::ImageSpec spec(image.width, image.height, image.channels, OIIO::TypeDesc::UINT8);
    spec.attribute("Orientation", orientation);
    ASSERT_TRUE(output->open(path.string(), spec));
    ASSERT_TRUE(output->write_image(OIIO::TypeDesc::FLOAT, image.pixels.data()));
    ASSERT_TRUE(output->close());
}

/// A COLMAP model of one camera of 8 x 6 and another of 5 x 4, and the pictures `first` and b.png of them.
struct Capture {
    TempFolder folder;
    explicit Capture(const std::string& first = "a.png") {
        folder.write("sparse/0/cameras.txt", "1 PINHOLE 8 6 10 11 4.5 3.5\n2 SIMPLE_PINHOLE 5 4 7 2 2.5\n");
        folder.write("sparse/0/images.txt", "1 1 0 0 0 0 0 0 1 " + first + "\n\n2 1 0 0 0 0 0 1 2 b.png\n\n");
        std::filesystem::create_directories(folder / "images");
        if (first == "a.png") save_image(folder / "images/a.png", ramp(8, 6));
        save_image(folder / "images/b.png", ramp(5, 4));
    }
    Dataset load(int downscale = 1, bool need_images = true) const {
        DatasetOptions options;
        options.downscale = downscale;
        options.need_images = need_images;
        return load_dataset(folder.path(), options);
    }
};

TEST(SyntheticDataset, OfSeveralCamerasAndSizes) {
    const Capture capture;
    const Dataset dataset = capture.load();
    EXPECT_EQ(load_frame_image(dataset.frames[0]).width, 8);
    EXPECT_EQ(load_frame_image(dataset.frames[1]).width, 5);
    EXPECT_EQ(dataset.frames[1].camera.fx, 7);
}

TEST(SyntheticDataset, StayAsStoredWhereTheModelHasTheStoredShape) {
    if (!OIIO::ImageOutput::create("a.jpg")) GTEST_SKIP() << "OpenImageIO writes no JPEG here";
    const Capture capture("a.tif");
    for (int orientation : {3, 6}) {
        for (const char* name : {"a.tif", "a.jpg"}) {
            write_turned(capture.folder / "images" / name, ramp(8, 6), orientation);
            ASSERT_EQ(read_image_size(capture.folder / "images" / name).orientation, orientation);
        }
        const Frame frame = capture.load().frames[0];
        EXPECT_EQ(frame.orientation, 1);
        EXPECT_EQ(load_frame_image(frame).pixels, ramp(8, 6).pixels);
    }
}

TEST(SyntheticDataset, AreTurnedWhereOnlyThatFitsTheModel) {
    const Capture capture("a.tif");
    const Image stored = ramp(6, 8);
    for (int orientation : {5, 6, 7, 8}) {
        write_turned(capture.folder / "images/a.tif", stored, orientation);
        const Frame frame = capture.load().frames[0];
        EXPECT_EQ(frame.orientation, orientation);
        EXPECT_EQ(frame.camera.width, 8);
        EXPECT_EQ(load_frame_image(frame).pixels, oriented(stored, orientation).pixels);
    }
    for (int orientation : {1, 3}) {
        write_turned(capture.folder / "images/a.tif", stored, orientation);
        expect_error<InputError>([&] { capture.load(); }, {"a.tif", "6 x 8", "8 x 6"});
    }
}

TEST(SyntheticDataset, SmallerCopiesAreUsedWhereTheyAre) {
    const Capture capture;
    std::filesystem::create_directories(capture.folder / "images_2");
    save_image(capture.folder / "images_2/a.png", ramp(4, 3));
    for (bool need_images : {true, false}) {
        const Dataset half = capture.load(2, need_images);
        EXPECT_EQ(half.frames[0].image_path, capture.folder / "images_2/a.png");
        EXPECT_EQ(half.frames[0].name, "a.png");
        EXPECT_EQ(half.frames[0].camera.width, 4);
        EXPECT_EQ(half.frames[0].camera.fx, 5);
        EXPECT_EQ(half.frames[0].camera.cy, 1.75);
        EXPECT_EQ(load_frame_image(half.frames[0]).pixels, ramp(4, 3).pixels);
        // The other picture has no copy.
        EXPECT_EQ(half.frames[1].image_path, capture.folder / "images/b.png");
        EXPECT_EQ(half.frames[1].camera.width, 2);
        EXPECT_EQ(load_frame_image(half.frames[1]).width, 2);
    }
    EXPECT_EQ(capture.load(1).frames[0].camera.width, 8);
    EXPECT_EQ(capture.load(4).frames[0].image_path, capture.folder / "images/a.png");
    std::filesystem::remove_all(capture.folder / "images");
    EXPECT_EQ(capture.load(2).frames.size(), 1u);
    EXPECT_EQ(capture.load(2).missing_images, 1);
}

TEST(SyntheticDataset, CamerasAloneNeedNoFittingPicture) {
    const Capture capture;
    save_image(capture.folder / "images/a.png", ramp(7, 7));
    capture.folder.write("images/b.png", "no picture");
    const Dataset dataset = capture.load(1, false);
    EXPECT_EQ(dataset.frames[0].camera.width, 8);
    EXPECT_EQ(dataset.frames[1].camera.width, 5);
    EXPECT_EQ(capture.load(2, false).frames[0].camera.width, 4);
}

TEST(SyntheticDataset, DeepAndLinearFilesKeepTheirValues) {
    const Capture capture;
    const auto text = "1 1 0 0 0 0 0 0 1 a.exr\n\n2 1 0 0 0 0 0 1 2 b.png\n\n";
    capture.folder.write("sparse/0/images.txt", text);
    Image bright = ramp(8, 6);
    bright.pixels[5] = 3.25f;
    save_image(capture.folder / "images/a.exr", bright);
    std::vector<uint16_t> words(5 * 4 * 3);
    for (size_t i = 0; i < words.size(); ++i) words[i] = uint16_t(i * 1001);
    auto output = OIIO::ImageOutput::create("b.png");
    if (!output) GTEST_SKIP() << "OpenImageIO writes no PNG here";
    ASSERT_TRUE(output->open((capture.folder / "images/b.png").string(),
                             OIIO::ImageSpec(5, 4, 3, OIIO::TypeDesc::UINT16)));
    ASSERT_TRUE(output->write_image(OIIO::TypeDesc::UINT16, words.data()));
    ASSERT_TRUE(output->close());
    const Dataset dataset = capture.load();
    EXPECT_FALSE(dataset.frames[0].eight_bit);
    EXPECT_FALSE(dataset.frames[1].eight_bit);
    EXPECT_EQ(load_frame_image(dataset.frames[0]).pixels, bright.pixels);
    EXPECT_EQ(load_frame_image(dataset.frames[1]).pixels[59], float(59 * 1001) / 65535.0f);
    EXPECT_TRUE(Capture().load().frames[0].eight_bit);

    bright.at(3, 2)[1] = NAN;
    save_image(capture.folder / "images/a.exr", bright);
    expect_error<InputError>([&] { load_frame_image(dataset.frames[0]); },
                             {"a.exr", "column 3, row 2", "not finite"});
}

Image half_white(int width, int height) {
    Image mask(width, height, 3);
    for (int y = 0; y < height; ++y)
        for (int x = width / 2; x < width; ++x)
            for (int c = 0; c < 3; ++c) mask.at(x, y)[c] = 1;
    return mask;
}

Dataset with_masks(const Capture& capture, MaskUse use, int downscale = 1) {
    DatasetOptions options;
    options.masks = use;
    options.downscale = downscale;
    return load_dataset(capture.folder.path(), options);
}

TEST(Masks, AreFoundByThePicturesName) {
    for (const char* name : {"masks/a.png.png", "masks/a.png"}) {
        const Capture capture;
        EXPECT_EQ(capture.load().frames[0].masks, MaskUse::cut);
        std::filesystem::create_directories(capture.folder / "masks");
        save_image(capture.folder / name, half_white(8, 6));
        const Dataset dataset = capture.load();
        EXPECT_EQ(dataset.frames[0].mask_path, capture.folder / name);
        EXPECT_EQ(dataset.frames[0].masks, MaskUse::ignore);
        EXPECT_TRUE(dataset.frames[1].mask_path.empty());
        EXPECT_EQ(dataset.frames[1].masks, MaskUse::ignore);

        const auto [picture, weights] = load_training_image(dataset.frames[0], {1, 1, 1});
        EXPECT_EQ(picture.pixels, ramp(8, 6).pixels);
        ASSERT_EQ(weights.pixels.size(), 48u);
        EXPECT_EQ(*weights.at(3, 2), 0);
        EXPECT_EQ(*weights.at(4, 2), 1);
        EXPECT_TRUE(load_training_image(dataset.frames[1], {}).weights.pixels.empty());

        const Frame cut = with_masks(capture, MaskUse::cut).frames[0];
        const auto over = load_training_image(cut, {0.25f, 0.5f, 1});
        EXPECT_TRUE(over.weights.pixels.empty());
        EXPECT_EQ(over.image.at(0, 0)[1], 0.5f);
        EXPECT_EQ(over.image.at(5, 3)[1], ramp(8, 6).at(5, 3)[1]);

        const Frame none = with_masks(capture, MaskUse::none).frames[0];
        EXPECT_EQ(load_frame_image(none).channels, 3);
    }
}

TEST(Masks, MayBeAlphaAndOfAnotherSize) {
    const Capture capture;
    Image picture = ramp(8, 6, 4);
    for (int y = 0; y < 6; ++y)
        for (int x = 0; x < 8; ++x) picture.at(x, y)[3] = y < 3 ? 1.0f : 0.0f;
    save_image(capture.folder / "images/a.png", picture);
    EXPECT_EQ(load_training_image(capture.load().frames[0], {1, 0, 0}).image.at(2, 4)[0], 1);
    const auto ignored = load_training_image(with_masks(capture, MaskUse::ignore).frames[0], {1, 0, 0});
    EXPECT_EQ(*ignored.weights.at(2, 4), 0);
    EXPECT_EQ(*ignored.weights.at(2, 2), 1);
    EXPECT_EQ(ignored.image.at(2, 4)[0], picture.at(2, 4)[0]);
    EXPECT_EQ(load_frame_image(with_masks(capture, MaskUse::none).frames[0]).channels, 3);

    // The mask of a picture twice as large; what counts is what both let through. It shrinks with the
    // picture.
    std::filesystem::create_directories(capture.folder / "masks");
    save_image(capture.folder / "masks/a.png", half_white(16, 12));
    const auto both = load_training_image(capture.load().frames[0], {});
    EXPECT_EQ(*both.weights.at(3, 2), 0);
    EXPECT_EQ(*both.weights.at(4, 2), 1);
    EXPECT_EQ(*both.weights.at(4, 3), 0);
    const auto small = load_training_image(with_masks(capture, MaskUse::automatic, 2).frames[0], {});
    ASSERT_EQ(small.weights.width, 4);
    EXPECT_EQ(*small.weights.at(1, 0), 0);
    EXPECT_EQ(*small.weights.at(2, 0), 1);
    EXPECT_EQ(*small.weights.at(2, 1), 0.5f);
    // A folder of smaller copies comes first where that size is asked for.
    std::filesystem::create_directories(capture.folder / "masks_2");
    save_image(capture.folder / "masks_2/a.png", half_white(8, 6));
    EXPECT_EQ(with_masks(capture, MaskUse::automatic, 2).frames[0].mask_path,
              capture.folder / "masks_2/a.png");
    EXPECT_EQ(with_masks(capture, MaskUse::automatic, 1).frames[0].mask_path, capture.folder / "masks/a.png");
    save_image(capture.folder / "masks/a.png", half_white(8, 8));
    expect_error<InputError>([&] { load_frame_image(capture.load().frames[0]); },
                             {"masks/a.png", "8 x 8", "8 x 6"});
}

TEST(Masks, MayBeNamedByTheModel) {
    TempFolder folder;
    folder.write("transforms.json", R"({"fl_x": 10, "w": 8, "h": 6, "frames": [{"file_path": "shots/a.png",
        "mask_path": "cover/a.png", "transform_matrix": [[1,0,0,0],[0,1,0,0],[0,0,1,0],[0,0,0,1]]}]})");
    for (const char* name : {"shots", "cover"}) std::filesystem::create_directories(folder / name);
    save_image(folder / "shots/a.png", ramp(8, 6));
    save_image(folder / "cover/a.png", half_white(8, 6));
    const Frame frame = load_dataset(folder.path(), {}).frames.at(0);
    EXPECT_EQ(frame.mask_path, folder / "cover/a.png");
    EXPECT_EQ(*load_training_image(frame, {}).weights.at(0, 0), 0);
}

}  // namespace
