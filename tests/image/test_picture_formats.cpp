// SPDX-License-Identifier: Apache-2.0
// The formats that are read: whole files only, within limits, known by their first bytes, without a word on
// standard error.
#include <OpenImageIO/imageio.h>

#include <cmath>
#include <fstream>

#include "ewa/image.h"
#include "image/image_files.h"
#include "support/png_bytes.h"
#include "support/temp_folder.h"

namespace {

using namespace ewa;
using test::big;
using test::bytes_of;
using test::deflated;
using test::expect_error;
using test::png_chunk;
using test::TempFolder;

/// A file as OpenImageIO writes it.
struct Kind {
    std::string name;                        // with the extension
    OIIO::TypeDesc type;                     // of the file's values
    std::string attribute = {}, value = {};  // one of OpenImageIO's
    int channels = 3;
    bool tiles = false;
    double error = 0;  // the codec's, of values in 0 to 1
};

void PrintTo(const Kind& kind, std::ostream* out) {
    *out << kind.name << " " << kind.attribute << " " << kind.value;
}

const OIIO::TypeDesc kByte = OIIO::TypeDesc::UINT8, kWord = OIIO::TypeDesc::UINT16,
                     kFloat = OIIO::TypeDesc::FLOAT, kHalf = OIIO::TypeDesc::HALF;

std::vector<Kind> kinds() {
    return {{"a.png", kByte},
            {"a.png", kWord, "", "", 4},
            {"a.png", kByte, "", "", 1},
            {"a.jpg", kByte, "Compression", "jpeg:100", 3, false, 0.1},
            {"a.jpg", kByte, "jpeg:progressive", "1", 3, false, 0.1},
            {"a.jpg", kByte, "", "", 1, false, 0.1},
            {"a.tif", kByte, "Compression", "none"},
            {"a.tif", kWord, "Compression", "none", 4},
            {"a.tif", kFloat, "Compression", "lzw"},
            {"a.tif", kByte, "Compression", "zip"},
            {"a.tif", kByte, "Compression", "packbits"},
            {"a.tif", kByte, "Compression", "jpeg", 3, false, 0.2},
            {"a.tif", kByte, "planarconfig", "separate"},
            {"a.tif", kByte, "Compression", "none", 3, true},
            {"a.exr", kFloat, "Compression", "none"},
            {"a.exr", kFloat, "Compression", "zip", 4},
            {"a.exr", kHalf, "Compression", "piz", 3, false, 1e-3},
            {"a.exr", kHalf, "Compression", "dwaa", 3, false, 0.1},
            {"a.exr", kHalf, "Compression", "rle", 3, true, 1e-3},
            {"a.webp", kByte, "", "", 3, false, 0.2},
            {"a.bmp", kByte},
            {"a.ppm", kByte},
            {"a.pgm", kByte, "", "", 1},
            {"a.hdr", kFloat, "", "", 3, false, 0.01}};
}

constexpr int kPictureWidth = 33, kPictureHeight = 21;

/// Smooth enough for the codecs that lose something; alpha is nowhere 0.
Image picture(int channels) {
    Image image(kPictureWidth, kPictureHeight, channels);
    for (int y = 0; y < kPictureHeight; ++y)
        for (int x = 0; x < kPictureWidth; ++x)
            for (int c = 0; c < channels; ++c)
                image.at(x, y)[c] =
                    float(std::lround((0.5 + 0.3 * std::sin(0.2 * x + 0.15 * y + c)) * 255)) / 255;
    return image;
}

void write(const std::filesystem::path& path, const Kind& kind, const Image& image) {
    auto output = OIIO::ImageOutput::create(path.string());
    ASSERT_TRUE(output);
    OIIO::ImageSpec spec(image.width, image.height, image.channels, kind.type);
    spec.attribute("oiio:UnassociatedAlpha", 1);
    spec.attribute("pnm:pfmflip",
                   0);  // OpenImageIO 2.5 writes any PNM upside down that it is given as floats
    if (kind.value == "1")
        spec.attribute(kind.attribute, 1);
    else if (!kind.attribute.empty())
        spec.attribute(kind.attribute, kind.value);
    if (kind.tiles) spec.tile_width = spec.tile_height = 16;
    ASSERT_TRUE(output->open(path.string(), spec)) << output->geterror();
    // Writes tiles too.
    ASSERT_TRUE(output->write_image(OIIO::TypeDesc::FLOAT, image.pixels.data())) << output->geterror();
    ASSERT_TRUE(output->close());
}

/// Whether this machine's OpenImageIO writes such files. That of the downloads writes neither PNG nor JPEG.
bool is_written(const std::string& name) {
    return OIIO::ImageOutput::create(name) != nullptr;
}

class PictureFormat : public testing::TestWithParam<Kind> {};

TEST_P(PictureFormat, KeepsItsPixels) {
    if (!is_written(GetParam().name)) GTEST_SKIP() << "OpenImageIO writes no " << GetParam().name << " here";
    TempFolder folder;
    const auto path = folder / GetParam().name;
    const Image image = picture(GetParam().channels);
    write(path, GetParam(), image);
    const Image loaded = load_image(path);
    ASSERT_EQ(loaded.width, kPictureWidth);
    ASSERT_EQ(loaded.height, kPictureHeight);
    ASSERT_EQ(loaded.channels, GetParam().channels == 4 ? 4 : 3);
    double largest = 0;
    for (int y = 0; y < kPictureHeight; ++y)
        for (int x = 0; x < kPictureWidth; ++x)
            for (int c = 0; c < loaded.channels; ++c)
                largest = std::max(largest, std::abs(double(loaded.at(x, y)[c]) -
                                                     double(image.at(x, y)[image.channels == 1 ? 0 : c])));
    EXPECT_LE(largest, GetParam().error + 1e-6);
    const ImageSize size = read_image_size(path);
    EXPECT_EQ(size.width, kPictureWidth);
    EXPECT_EQ(size.height, kPictureHeight);
    EXPECT_EQ(size.eight_bit, GetParam().type == kByte);
}

TEST_P(PictureFormat, IsWholeOrAnError) {
    if (!is_written(GetParam().name)) GTEST_SKIP() << "OpenImageIO writes no " << GetParam().name << " here";
    TempFolder folder;
    const auto path = folder / GetParam().name;
    write(path, GetParam(), picture(GetParam().channels));
    const std::string whole = test::file_bytes(path);
    testing::internal::CaptureStderr();
    // At every byte of its beginning and its end, and at some between.
    for (size_t n = whole.size(); n-- > 0;) {
        if (n > 600 && n + 64 < whole.size() && n % 37 != 0) continue;
        std::filesystem::resize_file(path, n);
        EXPECT_THROW(load_image(path), InputError) << n << " bytes of " << whole.size();
    }
    EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
}

INSTANTIATE_TEST_SUITE_P(Unit, PictureFormat, testing::ValuesIn(kinds()));

std::string little(uint32_t value, size_t bytes = 4) {
    return bytes_of(value).substr(0, bytes);
}
std::string text_of(const char* bytes, size_t size) {
    return {bytes, size};
}

/// An uncompressed grey TIFF whose pixels stand at the end.
std::string tiff(uint32_t width, uint32_t height, uint32_t strip_bytes) {
    const auto entry = [](uint32_t tag, uint32_t value) {
        return little(tag, 2) + little(4, 2) + little(1) + little(value);
    };
    return text_of("II\x2a\0", 4) + little(8) + little(8, 2) + entry(256, width) + entry(257, height) +
           entry(258, 8) + entry(259, 1) + entry(262, 1) + entry(273, 110) + entry(278, height) +
           entry(279, strip_bytes) + little(0);
}

TEST(PictureFiles, ATruncatedTiffWithItsPixelsLastIsAnError) {
    TempFolder folder;
    const std::string pixels(20 * 10, '\x40');
    const auto path = folder.write("a.tif", tiff(20, 10, 200) + pixels);
    EXPECT_EQ(load_image(path).at(19, 9)[2], 64 / 255.0f);
    EXPECT_EQ(test::read_every_cut(path, tiff(20, 10, 200) + pixels, [&] { load_image(path); }), 0u);
    // A strip that says itself that it is too short.
    folder.write("a.tif", tiff(20, 10, 199) + pixels);
    expect_error<InputError>([&] { load_image(path); }, {"a.tif", "incomplete", "199"});
}

/// A header of an EXR with one grey channel, of lines or of tiles.
std::string exr(int32_t right, int32_t bottom, uint32_t tile = 0, uint32_t flags = 0, int32_t sampling = 1) {
    const auto attribute = [](const char* name, const char* type, const std::string& value) {
        return std::string(name) + '\0' + type + '\0' + little(uint32_t(value.size())) + value;
    };
    const std::string window = little(0) + little(0) + bytes_of(right) + bytes_of(bottom);
    const std::string channel =
        text_of("Y\0", 2) + little(2) + little(0) + bytes_of(sampling) + bytes_of(sampling);
    return text_of("\x76\x2f\x31\x01", 4) + little(2 | flags | (tile ? 0x200 : 0)) +
           attribute("channels", "chlist", channel + '\0') + attribute("compression", "compression", "\3") +
           attribute("dataWindow", "box2i", window) + attribute("displayWindow", "box2i", window) +
           attribute("lineOrder", "lineOrder", text_of("\0", 1)) +
           attribute("pixelAspectRatio", "float", bytes_of(1.0f)) +
           attribute("screenWindowCenter", "v2f", little(0) + little(0)) +
           attribute("screenWindowWidth", "float", bytes_of(1.0f)) +
           (tile ? attribute("tiles", "tiledesc", little(tile) + little(tile) + '\0') : "") + '\0' +
           std::string(64, '\0');
}

/// A grey progressive JPEG whose scans all have the blocks' means, of which each takes one bit: 0.
std::string jpeg(uint32_t width, uint32_t height, int scans) {
    const std::string quantisation = "\xff\xdb" + big(67, 2) + text_of("\0", 1) + std::string(64, '\1');
    const std::string codes = "\xff\xc4" + big(20, 2) + text_of("\0\1", 2) + std::string(16, '\0');
    std::string bytes = "\xff\xd8" + quantisation + codes + "\xff\xc2" + big(11, 2) + "\x08" +
                        big(height, 2) + big(width, 2) + text_of("\x01\x01\x11\0", 4);
    for (int i = 0; i < scans; ++i)
        bytes += "\xff\xda" + big(8, 2) + text_of("\x01\x01\0\0\0\0", 6) + std::string(8, '\0');
    return bytes + "\xff\xd9";
}

/// As libwebp packs it without loss: 4 x 2 pixels of 200, 100, 50.
const std::string kOpaqueWebp = text_of(
    "\x52\x49\x46\x46\x1e\x00\x00\x00\x57\x45\x42\x50\x56\x50\x38\x4c"
    "\x11\x00\x00\x00\x2f\x03\x40\x00\x00\x07\x50\xb2\x22\x57\xa6\xff"
    "\x81\x88\xe8\x7f\x00\x00",
    38);

std::string webp(uint32_t flags, uint32_t width, uint32_t height) {
    const std::string body =
        "WEBPVP8X" + little(10) + little(flags) + little(width - 1, 3) + little(height - 1, 3);
    return "RIFF" + little(uint32_t(body.size())) + body;
}

std::string bmp(uint32_t width, uint32_t height, uint32_t packing) {
    return "BM" + little(54) + little(0) + little(54) + little(40) + little(width) + little(height) +
           little(1, 2) + little(24, 2) + little(packing) + std::string(20, '\0');
}

/// Nothing is decoded and no memory taken: the header is enough.
TEST(PictureFiles, HugeClaimsAreRefused) {
    TempFolder folder;
    const std::string hdr = "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y ";
    const struct {
        const char* name;
        std::string bytes, says;
    } cases[] = {
        {"a.tif", tiff(60000, 60000, 100), "60000 x 60000"},
        {"a.exr", exr(59999, 59999), "60000 x 60000"},
        {"b.exr", exr(1, 1499999999), "2 x 1500000000"},
        {"c.exr", exr(-2, 1499999999), "no data window"},
        {"d.exr", exr(3999, 3999, 1), "tiles"},
        {"e.exr", exr(99, 99, 60000), "tiles of 60000"},
        {"a.jpg", jpeg(65500, 65500, 1), "65500 x 65500"},
        {"a.webp", webp(0, 16384, 16384), "16384 x 16384"},
        {"a.bmp", bmp(60000, 60000, 0), "60000 x 60000 pixels of 3 channels, more than 200 million"},
        {"b.bmp", bmp(100, 0x80000000u, 0), "in a direction"},
        {"c.bmp", bmp(100, 100, 0), "rows of pixels"},
        {"a.ppm", "P6 60000 60000 255\n", "60000 x 60000"},
        {"b.ppm", "P6 1000 1000 255\n", "rows of pixels"},
        {"c.ppm", "P6 # a note\n 5 # another\n5\n100\n" + std::string(75, 'x'), "not 255"},
        {"d.ppm", "P6 99999999999999999999 1 255\n", "damaged"},
        {"a.hdr", hdr + "60000 +X 60000\n", "more than 200 million"},
        {"b.hdr", hdr + "2 +X -1\n", "not a two-dimensional picture"},
        {"c.hdr", hdr + "99999999999 +X 3\n", "in a direction"},
        {"d.hdr", hdr + "14000 +X 14000\n", "too many for its"},
    };
    for (const auto& one : cases) {
        const auto path = folder.write(one.name, one.bytes);
        expect_error<InputError>([&] { load_image(path); }, {one.name, one.says});
        expect_error<InputError>([&] { read_image_size(path); }, {one.name, one.says});
    }
}

TEST(PictureFiles, WhatIsNotReadSaysWhy) {
    TempFolder folder;
    EXPECT_EQ(load_image(folder.write("scans.jpg", jpeg(64, 64, 100))).at(63, 63)[0], 128 / 255.0f);
    const std::string upside_down =
        "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n+Y 2 +X 2\n" + std::string(16, '\x40');
    const struct {
        const char* name;
        std::string bytes, says;
    } cases[] = {
        {"scans.jpg", jpeg(64, 64, 101), "more than 100 scans"},
        {"film.webp", webp(2, 64, 64), "film"},
        {"clear.webp", webp(0x10, 64, 64), "transparent"},
        {"packed.bmp", bmp(4, 4, 1), "run-length"},
        {"deep.exr", exr(3, 3, 0, 0x800), "deep"},
        {"parts.exr", exr(3, 3, 0, 0x1000), "several parts"},
        {"chroma.exr", exr(3, 3, 0, 0, 2), "fewer pixels"},
        {"rows.hdr", upside_down, "-Y height +X width"},
    };
    for (const auto& one : cases) {
        const auto path = folder.write(one.name, one.bytes);
        expect_error<InputError>([&] { load_image(path); }, {one.name, one.says});
    }
}

TEST(PictureFiles, AreKnownByTheirFirstBytes) {
    TempFolder folder;
    const Image image = picture(3);
    save_image(folder / "a.png", image);
    save_image(folder / "a.exr", image);
    const std::string png = test::file_bytes(folder / "a.png"),
                      exr_bytes = test::file_bytes(folder / "a.exr");
    // Names that would make OpenImageIO choose another reader, or give it options.
    for (const char* name :
         {"a.jpg", "a.null?RES=4000x4000", "a.gif", "a.mp4", "a", "%04d.png", "a.png?x=1"}) {
        EXPECT_EQ(load_image(folder.write(name, png)).pixels, image.pixels) << name;
        EXPECT_EQ(load_image(folder.write(name, exr_bytes)).pixels, image.pixels) << name;
    }
    const std::string others[] = {
        "",
        "P",
        text_of("GIF89a\x01\0\x01\0\x80\0\0", 13),
        text_of("\xff\x4f\xff\x51\0\x2f", 6),
        text_of("\0\0\0\x0cjP  \r\n\x87\n", 12),
        text_of("FOR4\0\0\0\x20"
                "CIMG",
                12),
        "DDS |" + std::string(123, '\0'),
        text_of("\0\0\x0a\0\0\0\0\0\0\0\0\0\4\0\4\0\x20\0", 18) + std::string(90, 'x'),
        "P3 1 1 255 1 2 3 ",
        "RIFF" + little(4) + "AVI ",
        "8BPS" + std::string(40, '\0')};
    for (const std::string& bytes : others) {
        const auto path = folder.write("photo.png", bytes);
        expect_error<InputError>([&] { load_image(path); }, {"photo.png", "not a readable image"});
        expect_error<InputError>([&] { read_image_size(path); }, {"photo.png", "not a readable image"});
    }
    const auto empty = folder.write("x.null?RES=4000x4000", "");
    expect_error<InputError>([&] { load_image(empty); }, {"x.null?RES=4000x4000"});
}

/// 2 x 2 grey pixels, of the kind: bits, colour type, interlacing.
std::string png(const std::string& notes, const std::string& rows, const char* kind = "\x08\0\0\0\0") {
    return test::png_bytes(2, 2, text_of(kind, 5), notes, rows);
}

TEST(PictureFiles, DamagedAndStrangePngsAreOneErrorOrNone) {
    TempFolder folder;
    const std::string rows = text_of("\0\x10\x20\0\x30\x40", 6);
    testing::internal::CaptureStderr();
    // A profile that libpng does not like, a palette too long, a broken text: of no concern.
    const std::string notes = png_chunk("iCCP", text_of("x\0\0", 3) + deflated("no profile")) +
                              png_chunk("cHRM", "short") + png_chunk("zTXt", text_of("a\0\0junk", 7));
    const auto path = folder.write("a.png", png(notes, rows));
    EXPECT_EQ(load_image(path).at(1, 1)[0], 64 / 255.0f);
    // Rows that are missing, of a filter that there is not, and no deflate stream at all.
    for (const std::string& bytes :
         {png("", rows.substr(0, 4)), png("", text_of("\x09\x10\x20\0\x30\x40", 6))}) {
        folder.write("a.png", bytes);
        expect_error<InputError>([&] { load_image(path); }, {"a.png", "the PNG is damaged"});
    }
    folder.write("a.png", png("", rows, "\x07\0\0\0\0"));
    expect_error<InputError>([&] { load_image(path); }, {"a.png", "damaged"});
    EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
}

TEST(PictureFiles, AWebpWithoutLossKeepsItsBytes) {
    TempFolder folder;
    const auto path = folder.write("a.webp", kOpaqueWebp);
    const Image image = load_image(path);
    ASSERT_EQ(image.width, 4);
    ASSERT_EQ(image.channels, 3);
    EXPECT_EQ(image.at(3, 1)[0], 200 / 255.0f);
    EXPECT_EQ(image.at(3, 1)[2], 50 / 255.0f);
    EXPECT_EQ(test::read_every_cut(path, kOpaqueWebp, [&] { load_image(path); }), 0u);
}

TEST(PictureFiles, PngsOfEveryKind) {
    TempFolder folder;
    // A palette with transparency, two bits a pixel: colours 1 and 2, 3 and 0.
    const std::string palette = png_chunk("PLTE", text_of("\0\0\0\x10\x20\x30\x40\x50\x60\xff\xff\xff", 12)) +
                                png_chunk("tRNS", text_of("\0\x80", 2));
    const auto path = folder.write("a.png", png(palette, text_of("\0\x60\0\xc0", 4), "\x02\x03\0\0\0"));
    const Image image = load_image(path);
    ASSERT_EQ(image.channels, 4);
    EXPECT_EQ(image.at(0, 0)[2], 0x30 / 255.0f);
    EXPECT_EQ(image.at(0, 0)[3], 128 / 255.0f);
    EXPECT_EQ(image.at(1, 0)[3], 1);
    EXPECT_EQ(image.at(1, 1)[3], 0);
    // Interlaced: the first pass has the first pixel, the sixth the one beside it, the seventh the second
    // row.
    folder.write("a.png", png("", text_of("\0\x10\0\x20\0\x30\x40", 7), "\x08\0\0\0\x01"));
    const Image interlaced = load_image(path);
    EXPECT_EQ(interlaced.at(0, 0)[0], 0x10 / 255.0f);
    EXPECT_EQ(interlaced.at(1, 0)[0], 0x20 / 255.0f);
    EXPECT_EQ(interlaced.at(0, 1)[0], 0x30 / 255.0f);
    EXPECT_EQ(interlaced.at(1, 1)[0], 0x40 / 255.0f);
    // EXIF's orientation, of either byte order; no number of a turn: none.
    const std::string order = text_of("MM\0\x2a", 4) + big(8) + big(1, 2);
    for (const uint32_t orientation : {6u, 3u, 9u}) {
        const std::string exif = order + big(274, 2) + big(3, 2) + big(1) + big(orientation, 2) + big(0, 2);
        folder.write("a.png", png(png_chunk("eXIf", exif), text_of("\0\1\2\0\3\4", 6)));
        EXPECT_EQ(read_image_size(path).orientation, orientation == 9 ? 1 : int(orientation));
    }
    const std::string exif = text_of("II\x2a\0", 4) + little(8) + little(1, 2) + little(274, 2) +
                             little(3, 2) + little(1) + little(8);
    folder.write("a.png", png(png_chunk("eXIf", exif), text_of("\0\1\2\0\3\4", 6)));
    EXPECT_EQ(read_image_size(path).orientation, 8);
}

/// As phones write them: with EXIF, and turned by the file's own transformation.
TEST(Heif, BecomesJpegWithItsExif) {
    const TempFolder folder;
    OIIO::ImageSpec spec(64, 48, 3, kByte);
    spec.attribute("Make", "Apple");
    spec.attribute("Exif:FocalLength", 4.25f);
    spec.attribute("Exif:FocalLengthIn35mmFilm", 26);
    const std::string heif = (folder / "a.heic").string(), jpeg = (folder / "a.jpg").string();
    const auto output = OIIO::ImageOutput::create(heif);
    if (!output || !output->open(heif, spec)) GTEST_SKIP() << "OpenImageIO writes no HEIC here";
    std::vector<uint8_t> pixels(64 * 48 * 3);
    for (size_t i = 0; i < pixels.size(); ++i) pixels[i] = i / 3 % 64 < 32 ? 200 : uint8_t(40 * (i % 3));
    ASSERT_TRUE(output->write_image(kByte, pixels.data()) && output->close()) << output->geterror();
    ASSERT_TRUE(image::reads_heif());
    ASSERT_TRUE(image::write_jpeg_of_heif(heif, jpeg));
    const Image image = load_image(jpeg);
    ASSERT_EQ(image.width, 64);
    ASSERT_EQ(image.height, 48);
    for (int c = 0; c < 3; ++c) {
        EXPECT_NEAR(image.at(10, 20)[c], 200 / 255.0, 0.03) << c;
        EXPECT_NEAR(image.at(54, 20)[c], 40 * c / 255.0, 0.03) << c;
    }
    EXPECT_EQ(image::shot_of(jpeg).lens, "Apple//425/100/26");
    std::ofstream(folder / "damaged.heic") << "no photo";
    EXPECT_FALSE(image::write_jpeg_of_heif(folder / "damaged.heic", jpeg));
    EXPECT_FALSE(image::write_jpeg_of_heif(folder / "missing.heic", jpeg));
}

}  // namespace
