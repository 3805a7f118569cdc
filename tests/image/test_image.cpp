// SPDX-License-Identifier: Apache-2.0
#include <OpenImageIO/imageio.h>
#include <zlib.h>

#include <cmath>
#include <fstream>
#include <random>

#include "ewa/camera.h"
#include "ewa/error.h"
#include "ewa/image.h"
#include "image/image_files.h"
#include "support/file_limit.h"
#include "support/temp_folder.h"

namespace {

using namespace ewa;
using test::expect_error;
using test::TempFolder;

Image noise(int width, int height, int channels, unsigned seed, float low = 0, float high = 1) {
    Image image(width, height, channels);
    std::mt19937 generator(seed);
    std::uniform_real_distribution<float> uniform(low, high);
    for (float& v : image.pixels) v = uniform(generator);
    return image;
}

/// Ends the threads of OpenImageIO before the program ends. MinGW's build of it would wait for them without waking them.
class NoThreads : public testing::Environment {
  public:
    void TearDown() override { OIIO::attribute("threads", 1); }
};
[[maybe_unused]] testing::Environment* const no_threads = testing::AddGlobalTestEnvironment(new NoThreads);

/// As OpenImageIO writes it, for the kinds of file that save_image does not make.
template <class T>
void write_file(const std::filesystem::path& path, int width, int height, int channels, OIIO::TypeDesc type,
                const std::vector<T>& values) {
    auto output = OIIO::ImageOutput::create(path.string());
    OIIO::ImageSpec spec(width, height, channels, type);
    spec.attribute("oiio:UnassociatedAlpha", 1);
    ASSERT_TRUE(output->open(path.string(), spec));
    ASSERT_TRUE(output->write_image(type, values.data()));
    ASSERT_TRUE(output->close());
}

TEST(ImageFiles, PngRoundsAndClamps) {
    TempFolder folder;
    Image image(4, 1, 3);
    const float nan = std::nanf("");
    image.pixels = {
        0, 1, 0.5f, -3, 7, 0.4999f / 255, 0.5001f / 255, nan, 100.0f / 255, 254.4f / 255, 254.6f / 255, 2};
    save_image(folder / "a.png", image);
    const Image loaded = load_image(folder / "a.png");
    const int expected[] = {0, 255, 128, 0, 255, 0, 1, 0, 100, 254, 255, 255};
    ASSERT_EQ(loaded.channels, 3);
    for (size_t i = 0; i < 12; ++i) EXPECT_EQ(loaded.pixels[i], float(expected[i]) / 255.0f) << i;
    EXPECT_EQ(test::files_in(folder.path()), 1u);
}

TEST(ImageFiles, PanoramasSayWhatTheyAre) {
    const TempFolder folder;
    const Image image = noise(40, 20, 3, 8);
    for (const char* name : {"p.png", "p.jpg", "p.exr"}) {
        save_panorama(folder / name, image);
        save_image(folder / (std::string("plain") + name), image);
        EXPECT_EQ(load_image(folder / name).pixels, load_image(folder / (std::string("plain") + name)).pixels)
            << name;
    }
    // Readers of XMP look for these beginnings ("XMP Specification Part 3").
    const auto bytes = [&](const char* name) {
        std::ifstream file(folder / name, std::ios::binary);
        return std::string(std::istreambuf_iterator<char>(file), {});
    };
    const std::string png = bytes("p.png"), jpeg = bytes("p.jpg");
    const std::string packet = image::panorama_xmp(40, 20);
    EXPECT_NE(packet.find("GPano:FullPanoWidthPixels=\"40\""), std::string::npos);
    EXPECT_NE(packet.find("GPano:CroppedAreaImageHeightPixels=\"20\""), std::string::npos);
    const size_t chunk = png.find(std::string("iTXtXML:com.adobe.xmp\0\0\0\0\0", 26) + packet);
    ASSERT_EQ(chunk, 37u) << "behind IHDR and the chunk's length";
    EXPECT_NE(jpeg.find(std::string("http://ns.adobe.com/xap/1.0/\0", 29) + packet), std::string::npos);
    EXPECT_EQ(jpeg[20], '\xff');
    EXPECT_EQ(jpeg[21], '\xe1') << "behind JFIF's marker";
    // The chunk's checksum holds: libpng refuses another text.
    std::string other = png;
    other[chunk + 100] ^= 1;
    std::ofstream(folder / "other.png", std::ios::binary) << other;
    expect_error<InputError>([&] { load_image(folder / "other.png"); }, {"CRC"});
    EXPECT_THROW(
        image::with_xmp(std::vector<unsigned char>(jpeg.begin(), jpeg.end()), std::string(65536, 'x')),
        RunError);
}

TEST(ImageFiles, ExrKeepsEveryBit) {
    TempFolder folder;
    const Image image = noise(37, 21, 4, 1, -5, 20);
    save_image(folder / "a.exr", image);
    const Image loaded = load_image(folder / "a.exr");
    EXPECT_EQ(loaded.channels, 4);
    EXPECT_EQ(loaded.pixels, image.pixels);
    const ImageSize size = read_image_size(folder / "a.exr");
    EXPECT_EQ(size.width, 37);
    EXPECT_EQ(size.height, 21);
}

TEST(ImageFiles, AlphaDoesNotTouchColour) {
    TempFolder folder;
    Image image(2, 1, 4);
    image.pixels = {1, 0.2f, 0.4f, 0, 0.6f, 0.8f, 1, 0.2f};
    save_image(folder / "a.png", image);
    const Image loaded = load_image(folder / "a.png");
    ASSERT_EQ(loaded.channels, 4);
    for (size_t i = 0; i < 8; ++i) EXPECT_EQ(loaded.pixels[i], std::round(image.pixels[i] * 255) / 255) << i;
}

TEST(ImageFiles, GreyAndDeepFiles) {
    if (!OIIO::ImageOutput::create("a.png")) GTEST_SKIP() << "OpenImageIO writes no PNG here";
    TempFolder folder;
    write_file<uint8_t>(folder / "grey.png", 2, 1, 1, OIIO::TypeDesc::UINT8, {10, 200});
    const Image grey = load_image(folder / "grey.png");
    EXPECT_EQ(grey.pixels, (std::vector<float>{10 / 255.f, 10 / 255.f, 10 / 255.f, 200 / 255.f, 200 / 255.f,
                                               200 / 255.f}));
    write_file<uint8_t>(folder / "ga.png", 1, 1, 2, OIIO::TypeDesc::UINT8, {10, 51});
    const Image grey_alpha = load_image(folder / "ga.png");
    EXPECT_EQ(grey_alpha.pixels, (std::vector<float>{10 / 255.f, 10 / 255.f, 10 / 255.f, 51 / 255.f}));
    write_file<uint16_t>(folder / "deep.png", 1, 1, 3, OIIO::TypeDesc::UINT16, {1, 256, 65535});
    EXPECT_EQ(load_image(folder / "deep.png").pixels, (std::vector<float>{1 / 65535.f, 256 / 65535.f, 1}));
}

TEST(ImageFiles, Orientations) {
    // The corners of a 3 x 2 picture, upright: 1 2 above, 3 4 below. What each orientation stores instead, by
    // EXIF's table (tag 274): 1 as is, 2 mirrored, 3 turned by half, 4 upside down, 5 to 8 with rows for
    // columns.
    const int corners[8][4] = {{1, 2, 3, 4}, {2, 1, 4, 3}, {4, 3, 2, 1}, {3, 4, 1, 2},
                               {1, 3, 2, 4}, {2, 4, 1, 3}, {4, 2, 3, 1}, {3, 1, 4, 2}};
    for (int orientation = 1; orientation <= 8; ++orientation) {
        const bool swapped = orientation >= 5;
        Image stored(swapped ? 2 : 3, swapped ? 3 : 2, 3);
        const auto corner = [](const Image& image, int i) {
            return image.at(i % 2 == 0 ? 0 : image.width - 1, i < 2 ? 0 : image.height - 1);
        };
        for (int i = 0; i < 4; ++i)
            *const_cast<float*>(corner(stored, i)) = float(corners[orientation - 1][i]);
        const Image upright = oriented(stored, orientation);
        ASSERT_EQ(upright.width, 3);
        ASSERT_EQ(upright.height, 2);
        for (int i = 0; i < 4; ++i) EXPECT_EQ(*corner(upright, i), i + 1) << orientation;
    }
}

TEST(ImageFiles, RefusesWhatItCannotRead) {
    TempFolder folder;
    expect_error<InputError>([&] { load_image(folder / "none.png"); }, {"none.png", "no such file"});
    expect_error<InputError>([&] { load_image(folder.path()); }, {"not a regular file"});
    const auto text = folder.write("text.jpg", "this is\nno picture\n");
    expect_error<InputError>([&] { load_image(text); }, {"text.jpg"});
    expect_error<InputError>([&] { read_image_size(text); }, {"text.jpg"});
    expect_error<InputError>([&] { save_image(folder / "a.gif", Image(1, 1, 3)); }, {".png, .jpg or .exr"});
    expect_error<InputError>([&] { save_image(folder / "a.png", Image()); }, {"without pixels"});
    expect_error<RunError>([&] { save_image(folder / "none" / "a.png", Image(1, 1, 3)); }, {"none/a.png"});
}

TEST(ImageFiles, ReadsNoPartOfATruncatedFile) {
    TempFolder folder;
    const Image image = noise(5, 4, 3, 2);
    save_image(folder / "a.png", image);
    save_image(folder / "a.exr", image);
    save_image(folder / "a.jpg", noise(16, 16, 3, 3));
    for (const char* name : {"a.png", "a.exr", "a.jpg"}) {
        const auto path = folder / name;
        const std::string whole = test::file_bytes(path);
        const size_t succeeded = test::read_every_cut(path, whole, [&] { load_image(path); });
        EXPECT_EQ(succeeded, 0u) << name;
        EXPECT_NO_THROW(load_image(path));
    }
}

TEST(ImageFiles, HugeClaimIsRefused) {
    TempFolder folder;
    save_image(folder / "a.png", Image(3, 3, 3));
    std::string bytes = test::file_bytes(folder / "a.png");
    bytes.replace(16, 8,
                  std::string("\x00\x00\xf0\x00\x00\x00\xf0\x00", 8));  // IHDR's width and height: 61440
    const auto checksum = uint32_t(crc32(0, reinterpret_cast<const Bytef*>(&bytes[12]), 17));
    for (size_t i = 0; i < 4; ++i) bytes[29 + i] = char(checksum >> (24 - 8 * i));
    const auto path = folder.write("huge.png", bytes);
    expect_error<InputError>([&] { load_image(path); }, {"huge.png", "61440 x 61440"});
    bytes[29] ^= 1;
    folder.write("huge.png", bytes);
    expect_error<InputError>([&] { read_image_size(path); }, {"huge.png", "the PNG is damaged", "CRC"});
}

TEST(ImageFiles, FullDiskIsNoticed) {
    TempFolder folder;
    if (!test::FileLimit::exists()) GTEST_SKIP() << "no limit on the size of files";
    const test::FileLimit small(1000);
    for (const char* name : {"a.png", "a.exr"})
        expect_error<RunError>([&] { save_image(folder / name, noise(64, 64, 3, 3)); },
                               {name, "File too large"});
    EXPECT_EQ(test::files_in(folder.path()), 0u);
}

TEST(Downscale, MeansOfBlocks) {
    Image image(4, 2, 1);
    image.pixels = {1, 2, 3, 4, 5, 6, 7, 8};
    const Image half = downscale(image, 2);
    EXPECT_EQ(half.width, 2);
    EXPECT_EQ(half.height, 1);
    EXPECT_EQ(half.pixels, (std::vector<float>{3.5f, 5.5f}));
    const Image dot = downscale(image, 9);
    EXPECT_EQ(dot.width, 1);
    EXPECT_EQ(dot.height, 1);
    EXPECT_FLOAT_EQ(dot.pixels[0], 4.5f);
    EXPECT_EQ(downscale(image, 1).pixels, image.pixels);
}

// A picture whose value is the ray that its camera sees stays one, when the camera is scaled alike: the mean
// of a linear function over a pixel is its value in the middle.
TEST(Downscale, CameraAndPictureAgree) {
    Camera camera;
    camera.width = 37;
    camera.height = 22;
    camera.fx = 30;
    camera.fy = 25;
    camera.cx = 17.3;
    camera.cy = 12.1;
    Image image(camera.width, camera.height, 2);
    const auto ray = [](const Camera& c, int x, int y) {
        return std::pair((x + 0.5 - c.cx) / c.fx, (y + 0.5 - c.cy) / c.fy);
    };
    for (int y = 0; y < image.height; ++y)
        for (int x = 0; x < image.width; ++x) {
            image.at(x, y)[0] = float(ray(camera, x, y).first);
            image.at(x, y)[1] = float(ray(camera, x, y).second);
        }
    for (int factor : {2, 3, 5, 11, 50}) {
        const Image small = downscale(image, factor);
        const Camera scaled = downscale(camera, factor);
        ASSERT_EQ(small.width, scaled.width);
        ASSERT_EQ(small.height, scaled.height);
        for (int y = 0; y < small.height; ++y)
            for (int x = 0; x < small.width; ++x) {
                EXPECT_NEAR(small.at(x, y)[0], ray(scaled, x, y).first, 1e-3);
                EXPECT_NEAR(small.at(x, y)[1], ray(scaled, x, y).second,
                            small.height * factor == image.height ? 1e-6 : 1e-3);
            }
    }
}

TEST(Metrics, PsnrByHand) {
    Image a(5, 4, 3), b(5, 4, 3);
    EXPECT_EQ(psnr(a, b), INFINITY);
    for (float& v : b.pixels) v = 0.5f;
    EXPECT_NEAR(psnr(a, b), 10 * std::log10(4.0), 1e-12);
    b = Image(5, 4, 3);
    b.at(2, 3)[1] = 7;  // clamped to 1
    EXPECT_NEAR(psnr(a, b), 10 * std::log10(60.0), 1e-12);
    Image with_alpha(5, 4, 4);
    for (int x = 0; x < 5; ++x) with_alpha.at(x, 0)[3] = 1;
    EXPECT_EQ(psnr(a, with_alpha), INFINITY);
    expect_error<InputError>([&] { psnr(a, Image(4, 5, 3)); }, {"5 x 4 x 3", "4 x 5 x 3"});
    expect_error<InputError>([&] { ssim(a, Image(4, 5, 3)); }, {"5 x 4 x 3", "4 x 5 x 3"});
}

/// SSIM from its definition: one 11 x 11 window per pixel, zeros outside.
double brute_force_ssim(const Image& a, const Image& b) {
    double weights[11][11], sum = 0, total = 0;
    for (int j = 0; j < 11; ++j)
        for (int i = 0; i < 11; ++i)
            sum += weights[j][i] = std::exp(-((i - 5) * (i - 5) + (j - 5) * (j - 5)) / 4.5);
    for (int c = 0; c < 3; ++c)
        for (int y = 0; y < a.height; ++y)
            for (int x = 0; x < a.width; ++x) {
                double ma = 0, mb = 0, aa = 0, bb = 0, ab = 0;
                for (int j = -5; j <= 5; ++j)
                    for (int i = -5; i <= 5; ++i) {
                        if (x + i < 0 || y + j < 0 || x + i >= a.width || y + j >= a.height) continue;
                        const double w = weights[j + 5][i + 5] / sum;
                        const double va = std::clamp(double(a.at(x + i, y + j)[c]), 0.0, 1.0);
                        const double vb = std::clamp(double(b.at(x + i, y + j)[c]), 0.0, 1.0);
                        ma += w * va, mb += w * vb, aa += w * va * va, bb += w * vb * vb, ab += w * va * vb;
                    }
                total += (2 * ma * mb + 1e-4) * (2 * (ab - ma * mb) + 9e-4) /
                         ((ma * ma + mb * mb + 1e-4) * (aa - ma * ma + bb - mb * mb + 9e-4));
            }
    return total / (a.width * a.height * 3);
}

TEST(Metrics, WeightsSayWhatCounts) {
    Image a = noise(20, 16, 3, 11), weights(20, 16, 1);
    const Image b = noise(20, 16, 3, 12);
    EXPECT_TRUE(std::isnan(psnr(a, b, weights)));
    for (float& weight : weights.pixels) weight = 1;
    EXPECT_EQ(psnr(a, b, weights), psnr(a, b));
    EXPECT_EQ(ssim(a, b, weights), ssim(a, b));
    // By hand: two pixels, of which one counts by half.
    const Image white(2, 1, 3);
    Image other(2, 1, 3), shares(2, 1, 1);
    other.pixels = {0.1f, 0.1f, 0.1f, 0.3f, 0.3f, 0.3f};
    shares.pixels = {1, 0.5f};
    EXPECT_NEAR(psnr(white, other, shares), -10 * std::log10((0.01 + 0.5 * 0.09) / 1.5), 1e-6);
    // What stands under the mask does not matter.
    for (int y = 0; y < 16; ++y)
        for (int x = 0; x < 7; ++x) *weights.at(x, y) = 0;
    const double db = psnr(a, b, weights), similarity = ssim(a, b, weights);
    for (int y = 0; y < 16; ++y)
        for (int x = 0; x < 7; ++x) a.at(x, y)[1] = 0.77f;
    EXPECT_EQ(psnr(a, b, weights), db);
    EXPECT_EQ(ssim(a, b, weights), similarity);
    expect_error<InputError>([&] { psnr(a, b, shares); }, {"weights"});
}

TEST(Metrics, SsimAgainstBruteForce) {
    for (const auto& [width, height] : {std::pair(1, 1), {3, 20}, {11, 11}, {31, 27}}) {
        const Image a = noise(width, height, 3, 4, -0.1f, 1.1f), b = noise(width, height, 4, 5, -0.1f, 1.1f);
        EXPECT_NEAR(ssim(a, b), brute_force_ssim(a, b), 1e-12);
        EXPECT_NEAR(ssim(a, a), 1, 1e-12);
        Image close = a;
        for (size_t i = 0; i < close.pixels.size(); i += 7) close.pixels[i] += 0.05f;
        EXPECT_NEAR(ssim(a, close), brute_force_ssim(a, close), 1e-12);
        if (width > 1) {
            EXPECT_LT(ssim(a, close), 1 - 1e-6);
        }
    }
}

// Two grey pictures of one pixel: the window's middle weight is all there is.
TEST(Metrics, SsimByHand) {
    Image a(1, 1, 3), b(1, 1, 3);
    for (float& v : a.pixels) v = 0.25f;
    for (float& v : b.pixels) v = 0.5f;
    double sum = 0;
    for (int d = -5; d <= 5; ++d) sum += std::exp(-d * d / 4.5);
    const double w = 1 / (sum * sum), ma = w * 0.25, mb = w * 0.5;
    const double covariance = w * 0.125 - ma * mb, variances = w * (0.0625 + 0.25) - ma * ma - mb * mb;
    EXPECT_NEAR(
        ssim(a, b),
        (2 * ma * mb + 1e-4) * (2 * covariance + 9e-4) / ((ma * ma + mb * mb + 1e-4) * (variances + 9e-4)),
        1e-12);
}

}  // namespace
