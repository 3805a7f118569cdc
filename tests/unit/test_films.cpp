// SPDX-License-Identifier: Apache-2.0
// Films of many kinds, made here by ffmpeg: which frames are taken, and their colours.
#include <sys/stat.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <fstream>

#include "capture/film.h"
#include "capture/steps.h"
#include "core/process.h"
#include "ewa/image.h"
#include "scene/color.h"
#include "support/temp_folder.h"

namespace {

namespace fs = std::filesystem;
using namespace ewa;
using capture::FilmInfo;
using capture::HdrTransfer;
using Colour = std::array<double, 3>;

constexpr int kSide = 32, kColumns = 4, kWidth = kColumns * kSide, kHeight = 2 * kSide, kFrames = 10;
constexpr std::array<Colour, 8> kColours{{{200, 40, 30},
                                          {30, 180, 60},
                                          {40, 60, 210},
                                          {230, 230, 230},
                                          {128, 128, 128},
                                          {16, 16, 16},
                                          {240, 200, 20},
                                          {90, 30, 120}}};

double hlg_of_linear(double light) {
    constexpr double a = 0.17883277, b = 0.28466892, c = 0.55991073;
    return light <= 1.0 / 12 ? std::sqrt(3 * light) : a * std::log(12 * light - b) + c;
}
double pq_of_luminance(double luminance) {
    const double p = std::pow(luminance / 10000, 2610.0 / 16384);
    return std::pow((3424.0 / 4096 + 2413.0 / 128 * p) / (1 + 2392.0 / 128 * p), 2523.0 / 32);
}

/// An sRGB colour on a screen of 203 cd/m², as BT.2100 codes it.
Colour coded(const Colour& srgb, HdrTransfer transfer) {
    constexpr double kFromSrgb[3][3] = {{0.627403896, 0.329283038, 0.043313065},
                                        {0.069097289, 0.919540395, 0.011362316},
                                        {0.016391439, 0.088013308, 0.895595253}};
    Colour light{}, result{};
    for (size_t i = 0; i < 3; ++i)
        for (size_t k = 0; k < 3; ++k)
            light[i] += 203 * kFromSrgb[i][k] * scene::linear_of_srgb(srgb[k] / 255);
    const double luminance = 0.2627 * light[0] + 0.6780 * light[1] + 0.0593 * light[2];
    for (size_t i = 0; i < 3; ++i)
        result[i] = transfer == HdrTransfer::pq
                        ? pq_of_luminance(light[i])
                        : hlg_of_linear(light[i] / 1000 / std::pow(luminance / 1000, 0.2 / 1.2));
    return result;
}

/// The ffmpeg that writes films, where the first one of PATH is to read them alone.
std::string film_writer() {
    const char* writer = std::getenv("EWA_TEST_FILM_WRITER");
    return writer ? writer : "ffmpeg";
}

class Films : public testing::Test {
  protected:
    void SetUp() override {
        if (core::find_program("ffmpeg").empty()) GTEST_SKIP() << "no ffmpeg";
    }
    void TearDown() override { setenv("PATH", path_.c_str(), 1); }

    /// ffmpeg with these words. A word "IN" is a film of frames in `in`; the last one is the name of a file in the folder.
    void ffmpeg(const std::string& words, const std::string& name, const std::string& size = "128x64") {
        std::string command =
            film_writer() + " -v error -y " + words + " '" + (folder_ / name).string() + "'";
        const std::string in =
            "-f rawvideo -pix_fmt rgb48le -r 10 -s " + size + " -i " + (folder_ / "in").string();
        for (size_t at; (at = command.find(" IN ")) != std::string::npos;) command.replace(at + 1, 2, in);
        ASSERT_EQ(std::system(command.c_str()), 0) << command;
    }
    /// Ten frames of the colours, which may be coded.
    void write_colours(HdrTransfer transfer) {
        std::string frame;
        for (int y = 0; y < kHeight; ++y)
            for (int x = 0; x < kWidth; ++x) {
                const Colour& srgb = kColours[size_t(y / kSide * kColumns + x / kSide)];
                const Colour colour = transfer == HdrTransfer::none
                                          ? Colour{srgb[0] / 255, srgb[1] / 255, srgb[2] / 255}
                                          : coded(srgb, transfer);
                for (const double value : colour) {
                    const auto code = uint16_t(std::lround(65535 * value));
                    frame += {char(code & 255), char(code >> 8)};
                }
            }
        std::ofstream file(folder_ / "in", std::ios::binary);
        for (int i = 0; i < kFrames; ++i) file << frame;
    }
    /// Twenty grey frames, each brighter than the one before. The 4th, 9th, 14th and 19th are sharp.
    void write_steps() {
        std::ofstream file(folder_ / "in", std::ios::binary);
        for (int i = 0; i < 20; ++i)
            for (int y = 0; y < 96; ++y)
                for (int x = 0; x < 128; ++x)
                    for (int c = 0; c < 3; ++c) {
                        const int value = i % 5 == 3 && x >= 64 && x % 4 == 0 ? 255 : 20 + 10 * i;
                        file.put(0).put(char(value));
                    }
    }
    std::vector<std::string> extract(const std::vector<std::string>& names, int frames) {
        std::vector<fs::path> films;
        for (const std::string& name : names) films.push_back(folder_ / name);
        fs::remove_all(folder_ / "images");
        return capture::extract_frames(films, folder_ / "images", frames, folder_ / "log.txt",
                                       [](const CaptureProgress&) { return true; });
    }
    std::vector<fs::path> images() const { return capture::photo_files(folder_ / "images"); }

    /// The largest difference of a frame's colours, of 255.
    double difference() {
        const Image image = load_image(folder_ / "images" / images().front());
        double most = 0;
        for (size_t i = 0; i < kColours.size(); ++i) {
            const int left = int(i) % kColumns * kSide, top = int(i) / kColumns * kSide;
            for (int c = 0; c < 3; ++c) {
                double sum = 0;
                int count = 0;
                for (int y = top + 12; y < top + 20; ++y)
                    for (int x = left + 12; x < left + 20; ++x, ++count)
                        sum += 255 * double(image.at(x, y)[c]);
                most = std::max(most, std::abs(sum / count - kColours[i][size_t(c)]));
            }
        }
        return most;
    }
    /// The brightness of the frames, in steps of write_steps().
    std::vector<int> steps() {
        std::vector<int> found;
        for (const fs::path& name : images()) {
            const Image image = load_image(folder_ / "images" / name);
            found.push_back(int(std::lround((255 * double(*image.at(20, 20)) - 20) / 10)));
        }
        return found;
    }
    void make_program(const std::string& name, const std::string& script) {
        std::ofstream(folder_ / name) << "#!/bin/sh\n" << script;
        chmod((folder_ / name).c_str(), 0755);
    }

    const test::TempFolder folder_;
    const std::string path_ = std::getenv("PATH");
};

struct Kind {
    const char *encoder, *pixels, *matrix, *range, *extension, *more = "";
    HdrTransfer transfer = HdrTransfer::none;
};

/// Every row whose encoder ffmpeg has. The first are ffmpeg's own, which all builds have.
constexpr std::array kKinds{
    Kind{"ffv1", "yuv420p", "bt709", "tv", "mkv"},
    Kind{"ffv1", "yuv420p", "bt601", "tv", "mkv"},
    Kind{"ffv1", "yuv420p", "bt709", "pc", "mkv"},
    Kind{"ffv1", "yuv420p10le", "bt2020", "tv", "mkv"},
    Kind{"ffv1", "yuv422p12le", "bt709", "tv", "mkv"},
    Kind{"ffv1", "yuv444p10le", "bt2020", "tv", "mkv", "", HdrTransfer::hlg},
    Kind{"ffv1", "yuv420p12le", "bt2020", "tv", "mkv", "", HdrTransfer::pq},
    Kind{"prores_ks", "yuv422p10le", "bt709", "tv", "mov"},
    Kind{"prores_ks", "yuv422p10le", "bt2020", "tv", "mov", "", HdrTransfer::hlg},
    Kind{"mpeg4", "yuv420p", "bt601", "tv", "avi", "-q:v 1"},
    Kind{"mpeg2video", "yuv420p", "bt709", "tv", "mts", "-q:v 1 -r 25"},
    Kind{"wmv2", "yuv420p", "bt601", "tv", "wmv", "-q:v 1"},
    Kind{"mjpeg", "yuvj420p", "bt601", "pc", "avi", "-q:v 1"},
    Kind{"libx264", "yuv420p", "bt709", "tv", "mp4", "-crf 4"},
    Kind{"libx264", "yuv420p", "bt601", "tv", "3gp", "-crf 4"},
    Kind{"libx264", "yuv420p10le", "bt709", "tv", "mp4", "-crf 4"},
    Kind{"libx264", "yuv422p10le", "bt709", "pc", "mkv", "-crf 4"},
    Kind{"libx265", "yuv420p10le", "bt709", "tv", "mp4", "-x265-params log-level=error:crf=4"},
    Kind{"libx265", "yuv420p10le", "bt2020", "tv", "mp4", "-x265-params log-level=error:crf=4",
         HdrTransfer::hlg},
    Kind{"libx265", "yuv420p10le", "bt2020", "tv", "mov", "-x265-params log-level=error:crf=4",
         HdrTransfer::pq},
    Kind{"libvpx-vp9", "yuv420p", "bt709", "tv", "webm", "-b:v 0 -crf 4"},
    Kind{"libvpx-vp9", "yuv420p10le", "bt2020", "tv", "webm", "-b:v 0 -crf 4", HdrTransfer::hlg},
    Kind{"libsvtav1", "yuv420p10le", "bt709", "tv", "mp4", "-crf 5"},
    Kind{"libtheora", "yuv420p", "bt601", "tv", "ogv", "-q:v 10"},
};

TEST_F(Films, HaveTheirColoursInEveryKind) {
    const std::string encoders =
        core::ask_program(
            {.command = {film_writer(), "-v", "error", "-encoders"}, .environment = {}, .log = "/dev/null"})
            .text;
    int tried = 0;
    for (const Kind& kind : kKinds) {
        if (encoders.find(" " + std::string(kind.encoder) + " ") == std::string::npos) continue;
        ++tried;
        const std::string matrix = kind.matrix, range = kind.range,
                          film = std::string("film.") + kind.extension;
        const std::string name = matrix == "bt601" ? "smpte170m" : matrix == "bt2020" ? "bt2020nc" : matrix;
        const std::string primaries = matrix == "bt601" ? "smpte170m" : matrix;
        const std::string transfer = kind.transfer == HdrTransfer::hlg  ? "arib-std-b67"
                                     : kind.transfer == HdrTransfer::pq ? "smpte2084"
                                     : matrix == "bt2020"               ? "bt2020-10"
                                                                        : primaries;
        write_colours(kind.transfer);
        ffmpeg("IN -vf scale=out_color_matrix=" + matrix + ":out_range=" + range +
                   ":flags=accurate_rnd+full_chroma_int+bicubic,format=" + kind.pixels + " -c:v " +
                   kind.encoder + " -colorspace " + name + " -color_primaries " + primaries + " -color_trc " +
                   transfer + " -color_range " + range + " -strict -1 " + kind.more,
               film);
        try {
            EXPECT_TRUE(extract({film}, 3).empty()) << film;
        } catch (const std::exception& error) {
            ADD_FAILURE() << error.what();
            continue;
        }
        ASSERT_GE(images().size(), 1u);  // an encoder may leave out frames that are the same
        const bool lossless = std::string(kind.encoder) == "ffv1";
        EXPECT_LE(difference(), lossless ? 2.01 : 2.5)
            << kind.encoder << " " << kind.pixels << " " << matrix << " " << range << " " << transfer << " ."
            << kind.extension;
    }
    EXPECT_GE(tried, 13);
}

/// The frames count as they are, whatever times a release or a film gives them.
TEST_F(Films, GiveTheSharpestFrames) {
    write_steps();
    const std::string size = "128x96";
    const std::vector<int> sharp = {3, 8, 13, 18};
    const auto expect_steps = [&](const std::string& name, const std::vector<int>& expected) {
        EXPECT_TRUE(extract({name}, 4).empty()) << name;
        EXPECT_EQ(steps(), expected) << name;
    };
    ffmpeg("IN -c:v mpeg4 -q:v 1", "plain.mp4", size);
    expect_steps("plain.mp4", sharp);
    ffmpeg("IN -vf 'setpts=(N+gte(N\\,8)*7+gte(N\\,12)*20)/10/TB' -c:v ffv1", "uneven.mkv", size);
    expect_steps("uneven.mkv", sharp);
    ffmpeg("IN -c:v gif -pix_fmt gray", "grey.gif", size);
    expect_steps("grey.gif", sharp);
    // Other streams: a small film, and a cover.
    const std::string plain = (folder_ / "plain.mp4").string();
    ffmpeg("-f lavfi -i color=red:s=32x32:r=10:d=2 -i " + plain + " -map 0 -map 1 -c:v mpeg4 -q:v 1",
           "two.mp4");
    expect_steps("two.mp4", sharp);
    ffmpeg("-f lavfi -i color=red:s=256x256 -frames:v 1", "cover.png");
    ffmpeg("-i " + (folder_ / "cover.png").string() + " -i " + plain +
               " -map 0 -map 1 -c copy -disposition:v:0 attached_pic",
           "cover.mp4");
    expect_steps("cover.mp4", sharp);
    // A name is no option, pattern or protocol.
    fs::rename(folder_ / "plain.mp4", folder_ / "-50%: a.mp4");
    expect_steps("-50%: a.mp4", sharp);
}

TEST_F(Films, HeldUprightAreUpright) {
    write_steps();
    ffmpeg("IN -c:v mpeg4 -q:v 1", "wide.mp4", "128x96");
    ffmpeg("-i " + (folder_ / "wide.mp4").string() + " -c copy -metadata:s:v rotate=90", "film.mp4");
    const std::string said =
        core::ask_program({.command = {"ffmpeg", "-nostdin", "-i", (folder_ / "film.mp4").string()},
                           .environment = {},
                           .log = "/dev/null",
                           .joined = true})
            .text;
    if (said.find("rotat") == std::string::npos) GTEST_SKIP() << "this ffmpeg writes no rotation by metadata";
    extract({"film.mp4"}, 3);
    const ImageSize size = read_image_size(folder_ / "images" / images().front());
    EXPECT_EQ(std::pair(size.width, size.height), std::pair(96, 128));
}

/// Releases differ in their options. What one lacks, ewa must not need.
TEST_F(Films, AreReadByReleasesFrom4To9) {
    write_colours(HdrTransfer::none);
    ffmpeg("IN -vf scale=out_color_matrix=bt709,format=yuv420p10le -c:v ffv1 -colorspace bt709", "ten.mkv");
    write_colours(HdrTransfer::hlg);
    ffmpeg(
        "IN -vf scale=out_color_matrix=bt2020,format=yuv420p10le -c:v ffv1 -colorspace bt2020nc "
        "-color_primaries bt2020 -color_trc arib-std-b67",
        "hlg.mkv");
    const std::string real = core::find_program("ffmpeg").string(),
                      probe = core::find_program("ffprobe").string();
    struct Release {
        const char *version, *removed;
    };
    for (const Release& release : {Release{"4.2.2", "-fps_mode|-enc_time_base|-display_rotation"},
                                   Release{"5.1.9", "-none"}, Release{"9.0", "-vsync|-passlogfile|-top"}})
        for (const bool has_probe : {true, false}) {
            make_program("ffmpeg",
                         "for word; do case $word in " + std::string(release.removed) +
                             ") echo \"Unrecognized option '$word'.\" >&2; exit 8;; *zscale*|*tonemap*) "
                             "echo 'No such filter' >&2; exit 1;; -version) echo ffmpeg version " +
                             release.version + "; exit 0;; esac; done; exec " + real + " \"$@\"\n");
            if (has_probe && !probe.empty()) fs::create_symlink(probe, folder_ / "ffprobe");
            setenv("PATH", folder_.path().c_str(), 1);
            for (const char* film : {"ten.mkv", "hlg.mkv"}) {
                extract({film}, 3);
                EXPECT_EQ(images().size(), 3u);
                EXPECT_LE(difference(), 2.01) << release.version << " " << film << " " << has_probe;
            }
            setenv("PATH", path_.c_str(), 1);
            fs::remove(folder_ / "ffprobe");
        }
}

/// Each has as many frames a second as the others.
TEST_F(Films, OfAFolderAreTakenByTheirLength) {
    write_steps();
    ffmpeg("IN -c:v ffv1", "slow.mkv", "128x96");  // 2 s
    // 1 s
    ffmpeg("-f rawvideo -pix_fmt rgb48le -r 20 -s 128x96 -i " + (folder_ / "in").string() + " -c:v ffv1",
           "fast film.mkv");
    EXPECT_TRUE(extract({"fast film.mkv", "slow.mkv"}, 6).empty());
    EXPECT_EQ(images(), (std::vector<fs::path>{"fast_film/frame_00001.jpg", "fast_film/frame_00002.jpg",
                                               "slow/frame_00001.jpg", "slow/frame_00002.jpg",
                                               "slow/frame_00003.jpg", "slow/frame_00004.jpg"}));
    std::ofstream(folder_ / "bad.mp4") << "no film";
    const auto remarks = extract({"bad.mp4", "slow.mkv"}, 4);
    ASSERT_EQ(remarks.size(), 1u);
    EXPECT_NE(remarks[0].find("bad.mp4: ffmpeg cannot read the video"), std::string::npos) << remarks[0];
    EXPECT_EQ(steps(), (std::vector<int>{3, 8, 13, 18}));
}

TEST_F(Films, ThatEndEarlyGiveWhatTheyHave) {
    write_steps();
    ffmpeg("IN -c:v mpeg4 -q:v 1 -movflags +faststart", "whole.mp4", "128x96");
    const std::string bytes = test::file_bytes(folder_ / "whole.mp4");
    std::ofstream(folder_ / "cut.mp4", std::ios::binary) << bytes.substr(0, bytes.size() * 2 / 3);
    const auto remarks = extract({"cut.mp4"}, 3);
    ASSERT_EQ(remarks.size(), 1u);
    EXPECT_NE(remarks[0].find("cut.mp4 is damaged: "), std::string::npos) << remarks[0];
    EXPECT_NE(remarks[0].find(" of its 20 frames"), std::string::npos) << remarks[0];
    EXPECT_EQ(images().size(), 3u);
}

TEST_F(Films, WithoutPicturesAreNamed) {
    ffmpeg("-f lavfi -i sine=d=1 -c:a aac", "sound.mp4");
    test::expect_error<InputError>([&] { extract({"sound.mp4"}, 3); }, {"sound.mp4: has no pictures"});
    std::ofstream(folder_ / "empty.mp4");
    test::expect_error<InputError>([&] { extract({"empty.mp4"}, 3); }, {"empty.mp4: ffmpeg cannot read"});
}

TEST_F(Films, OfTwoFisheyesNameTheWayOut) {
    write_steps();
    ffmpeg("IN -c:v mpeg4 -q:v 1 -f mp4", "one.insv", "128x96");
    EXPECT_TRUE(extract({"one.insv"}, 4).empty());
    EXPECT_EQ(steps(), (std::vector<int>{3, 8, 13, 18}));
    ffmpeg(
        "-f lavfi -i color=red:s=64x64:r=10:d=1 -f lavfi -i color=blue:s=64x64:r=10:d=1 -map 0 -map 1 -c:v "
        "mpeg4 -f mp4",
        "two.insv");
    ffmpeg("-f lavfi -i color=red:s=128x64:r=10:d=1 -c:v mpeg4 -f mp4", "wide.INSV");
    ffmpeg("-f lavfi -i color=red:s=64x64:r=10:d=1 -c:v mpeg4 -f mp4", "max.360");
    for (const char* name : {"two.insv", "wide.INSV"})
        test::expect_error<InputError>([&] { extract({name}, 3); }, {name, "Insta360 Studio", "360° MP4"});
    test::expect_error<InputError>([&] { extract({"max.360"}, 3); }, {"GoPro Player"});
}

/// A stream that was recorded states neither frames nor its length.
TEST_F(Films, HaveATotalWhereTheyStateNone) {
    write_steps();
    ffmpeg("IN -c:v ffv1 -f matroska - | cat >", "stream.mkv", "128x96");
    const std::string real = core::find_program("ffmpeg").string();
    for (const bool has_probe : {true, false}) {
        std::vector<int> totals{0};
        if (!has_probe) {
            fs::create_symlink(real, folder_ / "ffmpeg");
            setenv("PATH", folder_.path().c_str(), 1);
        }
        fs::remove_all(folder_ / "images");
        capture::extract_frames({folder_ / "stream.mkv"}, folder_ / "images", 4, folder_ / "log.txt",
                                [&](const CaptureProgress& now) {
                                    if (now.what == "looked at" && now.total != totals.back())
                                        totals.push_back(now.total);
                                    return true;
                                });
        EXPECT_EQ(totals, (has_probe ? std::vector<int>{0, 20} : std::vector<int>{0, 100, 20}));
    }
}

TEST(FilmColours, OfHighDynamicRangeBecomeSrgb) {
    for (const HdrTransfer transfer : {HdrTransfer::hlg, HdrTransfer::pq}) {
        const capture::HdrMap map(transfer);
        for (int r = 0; r < 256; r += 15)
            for (int g = 0; g < 256; g += 15)
                for (int b = 0; b < 256; b += 15) {
                    const Colour srgb{double(r), double(g), double(b)}, code = coded(srgb, transfer);
                    std::array<std::uint8_t, 6> bytes{};
                    for (size_t c = 0; c < 3; ++c) {
                        const auto value = uint16_t(std::lround(65535 * code[c]));
                        bytes[2 * c] = std::uint8_t(value >> 8);
                        bytes[2 * c + 1] = std::uint8_t(value & 255);
                    }
                    const Image image = map.map(bytes.data(), 1, 1);
                    for (size_t c = 0; c < 3; ++c) ASSERT_NEAR(255 * image.pixels[c], srgb[c], 0.6);
                }
        // What is brighter than white is white.
        const std::array<std::uint8_t, 6> brightest{255, 255, 255, 255, 255, 255};
        EXPECT_EQ(map.map(brightest.data(), 1, 1).pixels, (std::vector<float>{1, 1, 1}));
    }
}

TEST(FilmColours, HaveAMatrixAlsoWhereTheFilmNamesNone) {
    FilmInfo info;
    info.width = 640;
    info.height = 480;
    EXPECT_EQ(capture::matrix_word(info), "bt601");
    info.width = 1080;
    info.height = 1920;
    EXPECT_EQ(capture::matrix_word(info), "bt709");
    info.transfer = "smpte2084";
    EXPECT_EQ(capture::matrix_word(info), "bt2020");
    info.matrix = "bt470bg";
    EXPECT_EQ(capture::matrix_word(info), "bt601");
}

/// Small copies of films are no further films.
TEST(FilmFolders, ProxiesAreLeftOut) {
    const std::vector<fs::path> films{"CLIP/C0001.MP4", "DJI_0001.MP4",    "GX010001.MP4",
                                      "sub/S03E01.mp4", "VID_1_00_1.insv", "approximate.mov"},
        proxies{"DJI_0001.LRF",    "GL010001.LRV",     "LRV_1_11_1.insv",
                "Proxy/C0001.MP4", "SUB/C0001S03.MP4", "a_Proxy.mov"};
    std::vector<fs::path> all = films;
    all.insert(all.end(), proxies.begin(), proxies.end());
    EXPECT_EQ(capture::take_proxies(all), proxies);
    EXPECT_EQ(all, films);
    all = proxies;
    EXPECT_TRUE(capture::take_proxies(all).empty());
    EXPECT_EQ(all, proxies) << "they are all that there is";
    EXPECT_TRUE(capture::is_film("DJI_0001.LRF"));
}

}  // namespace
