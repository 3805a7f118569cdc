// SPDX-License-Identifier: Apache-2.0
// The parts of a capture that need neither ffmpeg nor COLMAP.
#include <cmath>

#include "capture/steps.h"
#include "image/image_files.h"
#include "platform/system.h"
#include "support/temp_folder.h"

namespace {

using namespace ewa;
using capture::PgmStream;

using Pixels = std::vector<std::uint8_t>;

/// Grey steps of this length, in both directions.
Pixels checkers(int width, int height, int length) {
    Pixels pixels(size_t(width) * size_t(height));
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x)
            pixels[size_t(y) * size_t(width) + size_t(x)] = (x / length + y / length) % 2 ? 200 : 50;
    return pixels;
}

/// The mean of each pixel and its neighbours to the left and right.
Pixels blurred(const Pixels& pixels) {
    Pixels result = pixels;
    for (size_t i = 1; i + 1 < pixels.size(); ++i)
        result[i] = std::uint8_t((pixels[i - 1] + pixels[i] + pixels[i + 1]) / 3);
    return result;
}

TEST(CaptureSharpness, IsTheVarianceOfTheLaplacian) {
    // 4 x 3 pixels have two inner ones, whose Laplacians are 4 - 0 and 0 - 10.
    const Pixels pixels = {0, 1, 2, 0, 1, 0, 2, 1, 0, 0, 3, 0};
    // First: 1 + 2 + 1 + 0 - 0 = 4. Second: 0 + 1 + 2 + 3 - 8 = -2. Mean 1, variance 9.
    EXPECT_DOUBLE_EQ(capture::sharpness(pixels.data(), 4, 3), 9);
    EXPECT_DOUBLE_EQ(capture::sharpness(Pixels(100, 77).data(), 10, 10), 0);
    EXPECT_DOUBLE_EQ(capture::sharpness(pixels.data(), 6, 2), 0);
}

TEST(CaptureSharpness, FallsWithBlur) {
    Pixels image = checkers(64, 48, 6);
    double last = capture::sharpness(image.data(), 64, 48);
    for (int i = 0; i < 3; ++i) {
        image = blurred(image);
        const double now = capture::sharpness(image.data(), 64, 48);
        EXPECT_LT(now, last);
        last = now;
    }
}

TEST(CaptureSharpness, TheSharpestOfEachPartIsTaken) {
    EXPECT_EQ(capture::sharpest({1, 5, 2, 7, 3, 4, 9, 8}, 4), (std::vector<int>{1, 3, 5, 6}));
    EXPECT_EQ(capture::sharpest({1, 5, 2, 7, 3}, 2), (std::vector<int>{1, 3}));
    EXPECT_EQ(capture::sharpest({1, 1, 1}, 9), (std::vector<int>{0, 1, 2}));
    EXPECT_EQ(capture::sharpest({}, 3), std::vector<int>{});
}

struct Picture {
    Pixels pixels;
    int width, height;
    bool operator==(const Picture&) const = default;
};

std::vector<Picture> pictures_of(const std::string& bytes, size_t piece) {
    std::vector<Picture> pictures;
    PgmStream stream([&](const std::uint8_t* pixels, int width, int height) {
        pictures.push_back({Pixels(pixels, pixels + width * height), width, height});
    });
    for (size_t at = 0; at < bytes.size(); at += piece) stream.add(std::string_view(bytes).substr(at, piece));
    return pictures;
}

/// Pixels may have the bytes of white space and of a header.
TEST(CapturePgm, ImagesArriveInPiecesOfAnySize) {
    const std::string bytes = "P5\n3 2\n255\n P5\n\n1P5 2 1\n255\n\n\nP5\n1 1\n255\nx";
    const std::vector<Picture> expected = {
        {{' ', 'P', '5', '\n', '\n', '1'}, 3, 2}, {{'\n', '\n'}, 2, 1}, {{'x'}, 1, 1}};
    for (size_t piece = 1; piece <= bytes.size(); ++piece) EXPECT_EQ(pictures_of(bytes, piece), expected);
}

TEST(CapturePgm, WhatIsNoPgmIsAnError) {
    for (const char* bytes :
         {"P6\n1 1\n255\nxxx", "P5\n0 1\n255\n", "P5\n99999 99999\n255\n", "P5\n1 1\n65535\nxx",
          "P5\n-1 1\n255\nx", "Error: a text that is longer than any header of an image, and no PGM"})
        test::expect_error<RunError>([&] { pictures_of(bytes, 7); }, {"not PGM"});
}

TEST(CapturePhotos, AreTheImagesOfAFolder) {
    const test::TempFolder folder;
    folder.write("b.jpg", "");
    folder.write("sub/a.png", "");
    folder.write("notes.txt", "no photo");
    // What ewa has made.
    folder.write("out/run/config.json", "{}");
    folder.write("out/run/metrics.jsonl", "");
    folder.write("out/run/test/a.png", "");
    folder.write("out/dataset/capture.json", "{}");
    folder.write("out/dataset/images/a.png", "");
    EXPECT_EQ(capture::photos_in(folder.path()), (std::vector<std::filesystem::path>{"b.jpg", "sub/a.png"}));
    test::expect_error<InputError>(
        [&] {
            capture::require_photos("photos", 2, {{"c.jpg", "it is empty"}});
        },
        {"has 2 photos", "at least 3", "1 photo cannot be used: c.jpg (it is empty)"});
    folder.write("c.HEIC", "anything");
    if (image::reads_heif()) return;
    // This machine may have a program that converts them.
    const std::string path = platform::variable("PATH");
    platform::set_variable("PATH", folder.path().string());
    test::expect_error<InputError>([&] { capture::photos_in(folder.path()); },
                                   {"1 photo is HEIC", "heif-convert"});
    platform::set_variable("PATH", path);
}

/// images.bin and points3D.bin as COLMAP writes them: a point that both images see.
TEST(CaptureModel, LosesViewsAndTheirPartsOfTracks) {
    const test::TempFolder folder;
    const auto bytes = [](auto value) {
        return std::string(reinterpret_cast<const char*>(&value), sizeof(value));
    };
    const auto image = [&](uint32_t id, const std::string& name) {
        std::string text = bytes(id);
        for (int i = 0; i < 7; ++i) text += bytes(double(i));
        text += bytes(uint32_t(1)) + name + '\0' + bytes(uint64_t(1));
        return text + bytes(1.0) + bytes(2.0) + bytes(int64_t(5));
    };
    std::string point = bytes(uint64_t(5));
    for (int i = 0; i < 3; ++i) point += bytes(double(i));
    point += "rgb" + bytes(0.5);
    const auto track = [&](uint32_t id) { return bytes(id) + bytes(uint32_t(0)); };
    folder.write("images.bin", bytes(uint64_t(2)) + image(7, "a.jpg") + image(8, "b.jpg"));
    folder.write("points3D.bin", bytes(uint64_t(1)) + point + bytes(uint64_t(2)) + track(7) + track(8));
    capture::remove_views(folder.path(), {"a.jpg", "other.jpg"});
    EXPECT_EQ(test::file_bytes(folder / "images.bin"), bytes(uint64_t(1)) + image(8, "b.jpg"));
    EXPECT_EQ(test::file_bytes(folder / "points3D.bin"),
              bytes(uint64_t(1)) + point + bytes(uint64_t(1)) + track(8));
    test::expect_error<InputError>([&] { capture::remove_views(folder.path(), {"b.jpg"}); }, {"every photo"});
}

TEST(CaptureInput, IsAVideoOrAFolderOfPhotosWithoutCameras) {
    const test::TempFolder folder;
    folder.write("photos/a.jpg", "\xff\xd8\xff");
    folder.write("inside/images/a.jpg", "\xff\xd8\xff");
    folder.write("phone/a.HEIC", "");
    folder.write("film.MOV", "");
    folder.write("dataset/images/a.jpg", "\xff\xd8\xff");
    folder.write("dataset/transforms.json", "{}");
    folder.write("other/notes.txt", "");
    for (const char* name : {"photos", "inside", "phone", "film.MOV"})
        EXPECT_TRUE(is_capture(folder / name)) << name;
    for (const char* name : {"dataset", "other", "missing", "photos/a.jpg"})
        EXPECT_FALSE(is_capture(folder / name)) << name;
}

}  // namespace
