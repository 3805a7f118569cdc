// SPDX-License-Identifier: Apache-2.0
// What is particular to JPEG: its colour spaces, and damage that libjpeg only warns of.
#include <cmath>
#include <cstdio>
#include <functional>

#include <jpeglib.h>

#include "ewa/error.h"
#include "ewa/image.h"
#include "image/image_files.h"
#include "support/png_bytes.h"
#include "support/temp_folder.h"

namespace {

using namespace ewa;
using test::big;
using test::expect_error;
using test::TempFolder;

constexpr int kWidth = 33, kHeight = 21;

/// Slow in x and y, so that nothing but rounding is lost at quality 100.
int value_at(int x, int y, int channel) {
    return int(std::lround(127 + 100 * std::sin(0.05 * x + 0.04 * y + channel)));
}

/// As libjpeg writes it; `set` may change what it is about to do.
void write_jpeg(const std::filesystem::path& path, int components, J_COLOR_SPACE from, J_COLOR_SPACE to,
                const std::function<void(jpeg_compress_struct&)>& set = {}) {
    jpeg_compress_struct jpeg{};
    jpeg_error_mgr errors{};
    jpeg.err = jpeg_std_error(&errors);
    jpeg_create_compress(&jpeg);
    std::FILE* file = std::fopen(path.string().c_str(), "wb");
    jpeg_stdio_dest(&jpeg, file);
    jpeg.image_width = kWidth;
    jpeg.image_height = kHeight;
    jpeg.input_components = components;
    jpeg.in_color_space = from;
    jpeg_set_defaults(&jpeg);
    jpeg_set_colorspace(&jpeg, to);
    jpeg_set_quality(&jpeg, 100, TRUE);
    if (set) set(jpeg);
    jpeg_start_compress(&jpeg, TRUE);
    std::vector<JSAMPLE> row(size_t(kWidth) * size_t(components));
    for (int y = 0; y < kHeight; ++y) {
        for (size_t i = 0; i < row.size(); ++i)
            row[i] = JSAMPLE(value_at(int(i) / components, y, int(i) % components));
        JSAMPROW rows = row.data();
        jpeg_write_scanlines(&jpeg, &rows, 1);
    }
    jpeg_finish_compress(&jpeg);
    jpeg_destroy_compress(&jpeg);
    std::fclose(file);
}

/// The largest difference of a value from what `expected` (x, y, channel) says of it, in levels.
double worst(const Image& image, const std::function<double(int, int, int)>& expected) {
    double largest = 0;
    for (int y = 0; y < image.height; ++y)
        for (int x = 0; x < image.width; ++x)
            for (int c = 0; c < image.channels; ++c)
                largest = std::max(largest, std::abs(double(image.at(x, y)[c]) * 255 - expected(x, y, c)));
    return largest;
}

TEST(Jpeg, WrittenOnesAreReadAgain) {
    Image picture(kWidth, kHeight, 3);
    for (int y = 0; y < kHeight; ++y)
        for (int x = 0; x < kWidth; ++x)
            for (int c = 0; c < 3; ++c) picture.at(x, y)[c] = float(value_at(x, y, c)) / 255;
    const auto bytes = image::encode_jpeg(picture, 95);
    const Image read = image::decode(bytes, "picture", 100);
    EXPECT_LT(worst(read, value_at), 6);
    EXPECT_LT(image::encode_jpeg(picture, 50).size(), bytes.size());
    picture.at(0, 0)[0] = std::nanf("");
    EXPECT_NO_THROW(image::encode_jpeg(picture, 95));
    EXPECT_THROW(image::encode_jpeg(Image(4, 4, 1), 95), RunError);
    EXPECT_THROW(image::encode_jpeg(Image(70000, 1, 3), 95), RunError);
}

TEST(Jpeg, ColourSpacesBecomeRgb) {
    TempFolder folder;
    const auto path = folder / "a.jpg";
    const auto ink = [](int x, int y, int c) { return value_at(x, y, c) * value_at(x, y, 3) / 255.0; };
    const struct {
        int components;
        J_COLOR_SPACE from, to;
        std::function<double(int, int, int)> expected;
    } cases[] = {{3, JCS_RGB, JCS_YCbCr, value_at},
                 {3, JCS_RGB, JCS_RGB, value_at},
                 {1, JCS_GRAYSCALE, JCS_GRAYSCALE, [](int x, int y, int) { return value_at(x, y, 0); }},
                 {2, JCS_UNKNOWN, JCS_UNKNOWN, [](int x, int y, int) { return value_at(x, y, 0); }},
                 {4, JCS_CMYK, JCS_CMYK, ink},
                 {4, JCS_CMYK, JCS_YCCK, ink}};
    for (const auto& one : cases) {
        write_jpeg(path, one.components, one.from, one.to);
        const Image image = load_image(path);
        EXPECT_EQ(image.channels, 3);
        // Each step of a conversion rounds; the colours of YCbCr have half the pixels in a direction.
        EXPECT_LE(worst(image, one.expected), 8) << one.components << " components, colour space " << one.to;
        for (const float value : image.pixels) ASSERT_EQ(value, float(std::lround(value * 255)) / 255.0f);
    }
    write_jpeg(path, 5, JCS_UNKNOWN, JCS_UNKNOWN, [](jpeg_compress_struct& jpeg) {
        for (int i = 0; i < jpeg.num_components; ++i) jpeg.comp_info[i].component_id = i;
        jpeg_simple_progression(&jpeg);  // one scan holds four components at most
    });
    expect_error<InputError>([&] { load_image(path); }, {"a.jpg", "more than 4 channels"});
}

TEST(Jpeg, SuperfluousBytesAreNoDamage) {
    TempFolder folder;
    const auto path = folder / "a.jpg";
    write_jpeg(path, 3, JCS_RGB, JCS_YCbCr);
    const std::string whole = test::file_bytes(path);
    const Image image = load_image(path);
    const size_t end = whole.rfind("\xff\xd9");
    testing::internal::CaptureStderr();
    // Between two markers, before the end, and after it.
    for (const size_t at : {whole.find("\xff\xdb"), end, end + 2}) {
        std::string bytes = whole;
        bytes.insert(at, "bytes of no use");
        EXPECT_EQ(load_image(folder.write("a.jpg", bytes)).pixels, image.pixels) << at;
    }
    EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
}

TEST(Jpeg, DamagedPixelsAreAnError) {
    TempFolder folder;
    const auto path = folder / "a.jpg";
    write_jpeg(path, 3, JCS_RGB, JCS_YCbCr, [](jpeg_compress_struct& jpeg) { jpeg.restart_interval = 2; });
    const std::string whole = test::file_bytes(path);
    const size_t scan = whole.find("\xff\xda") + 14, restart = whole.find("\xff\xd0", scan);
    testing::internal::CaptureStderr();
    // A scan whose first part has one byte, a restart marker out of turn, and superfluous bytes before such
    // damage.
    std::string cut = whole, turn = whole, both = whole;
    cut.erase(scan + 1, restart - scan - 1);
    turn[restart + 1] = '\xd5';
    both.replace(restart + 1, 1, "\xd5").insert(whole.find("\xff\xdb"), "bytes of no use");
    for (const std::string& bytes : {cut, turn, both}) {
        folder.write("a.jpg", bytes);
        expect_error<InputError>([&] { load_image(path); }, {"a.jpg", "the JPEG is damaged"});
    }
    folder.write("a.jpg", whole.substr(0, whole.size() - 1));
    expect_error<InputError>([&] { load_image(path); }, {"a.jpg", "the JPEG is truncated"});
    EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
}

TEST(Jpeg, ExifSaysTheOrientation) {
    TempFolder folder;
    const auto path = folder / "a.jpg";
    write_jpeg(path, 1, JCS_GRAYSCALE, JCS_GRAYSCALE);
    const std::string whole = test::file_bytes(path);
    for (const uint32_t orientation : {1u, 6u, 8u, 9u}) {
        const std::string exif = std::string("Exif\0\0MM\0\x2a", 10) + big(8) + big(1, 2) + big(274, 2) +
                                 big(3, 2) + big(1) + big(orientation, 2) + big(0, 2) + big(0);
        std::string bytes = whole;
        bytes.insert(2, "\xff\xe1" + big(uint32_t(exif.size() + 2), 2) + exif);
        folder.write("a.jpg", bytes);
        EXPECT_EQ(read_image_size(path).orientation, orientation == 9 ? 1 : int(orientation));
        // A block that ends too soon says nothing.
        bytes = whole;
        bytes.insert(2, "\xff\xe1" + big(18, 2) + exif.substr(0, 16));
        folder.write("a.jpg", bytes);
        EXPECT_EQ(read_image_size(path).orientation, 1);
    }
}

TEST(Jpeg, ExifSaysTheLensAndTheExposure) {
    TempFolder folder;
    const auto path = folder / "a.jpg";
    write_jpeg(path, 1, JCS_GRAYSCALE, JCS_GRAYSCALE);
    EXPECT_EQ(image::shot_of(path).lens, "");
    const std::string whole = test::file_bytes(path);
    const auto entry = [](uint32_t tag, uint32_t type, uint32_t count, const std::string& value) {
        return big(tag, 2) + big(type, 2) + big(count) + value;
    };
    // The first directory has 3 entries (8 to 50), the second one 5 (50 to 116).
    const std::string tiff = std::string("MM\0\x2a", 4) + big(8) + big(3, 2) +
                             entry(271, 2, 3, {"Me\0\0", 4}) + entry(272, 2, 6, big(116)) +
                             entry(34665, 4, 1, big(50)) + big(0) + big(5, 2) + entry(33434, 5, 1, big(130)) +
                             entry(33437, 5, 1, big(138)) + entry(34855, 3, 1, big(800, 2) + big(0, 2)) +
                             entry(37386, 5, 1, big(122)) + entry(41989, 3, 1, big(28, 2) + big(0, 2)) +
                             big(0) + std::string("Phone\0", 6) + big(42) + big(10) + big(1) + big(100) +
                             big(20) + big(10);
    const auto write = [&](const std::string& block) {
        const std::string exif = std::string("Exif\0\0", 6) + block;
        std::string bytes = whole;
        bytes.insert(2, "\xff\xe1" + big(uint32_t(exif.size() + 2), 2) + exif);
        folder.write("a.jpg", bytes);
    };
    write(tiff);
    EXPECT_EQ(image::shot_of(path).lens, "Me/Phone/42/10/28");
    EXPECT_NEAR(image::shot_of(path).exposure.value(), 1, 1e-9);  // 1/100 s, f/2, ISO 800
    // Whatever is cut off counts as absent.
    for (size_t size = 9; size < tiff.size(); ++size) {
        write(tiff.substr(0, size));
        const image::Shot shot = image::shot_of(path);
        EXPECT_TRUE(shot.lens != "Me/Phone/42/10/28" || !shot.exposure) << size;
    }
}

/// The check before a search decodes at an eighth of the size.
TEST(Jpeg, FaultsAreThoseOfLoading) {
    TempFolder folder;
    const auto path = folder / "a.jpg";
    for (const bool grey : {true, false}) {
        write_jpeg(path, grey ? 1 : 3, grey ? JCS_GRAYSCALE : JCS_RGB, grey ? JCS_GRAYSCALE : JCS_YCbCr);
        const std::string whole = test::file_bytes(path);
        EXPECT_EQ(image::image_fault(path), "");
        EXPECT_TRUE(image::ends_as_an_image(path));
        for (size_t size = 0; size < whole.size(); size += 7) {
            folder.write("a.jpg", whole.substr(0, size));
            EXPECT_FALSE(image::ends_as_an_image(path)) << size;
            const std::string fault = image::image_fault(path);
            expect_error<InputError>([&] { load_image(path); }, {fault});
            EXPECT_NE(fault, "") << size;
            EXPECT_EQ(fault.find("a.jpg"), std::string::npos) << fault;
        }
    }
}

/// 1,800 damaged files: each is a picture or an error of one line, and nothing is printed.
TEST(Jpeg, RandomDamageIsAnErrorOrAPicture) {
    TempFolder folder;
    const auto path = folder / "a.jpg";
    uint32_t state = 1;
    const auto random = [&](size_t below) {
        return (state = state * 1664525 + 1013904223, state >> 8) % below;
    };
    testing::internal::CaptureStderr();
    size_t errors = 0;
    for (const bool progressive : {false, true}) {
        write_jpeg(path, 3, JCS_RGB, JCS_YCbCr, [&](jpeg_compress_struct& jpeg) {
            if (progressive) jpeg_simple_progression(&jpeg);
        });
        const std::string whole = test::file_bytes(path);
        for (int i = 0; i < 900; ++i) {
            std::string bytes = whole;
            for (size_t n = random(6) + 1; n-- > 0;) bytes[2 + random(bytes.size() - 2)] = char(random(256));
            folder.write("a.jpg", bytes);
            try {
                EXPECT_EQ(load_image(path).channels, 3);
            } catch (const InputError& error) {
                EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos) << error.what();
                ++errors;
            }
        }
    }
    EXPECT_GT(errors, 300u);
    EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
}

}  // namespace
