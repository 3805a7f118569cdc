// SPDX-License-Identifier: Apache-2.0
// Pictures of ewa render of several renders: depth of field and motion blur; transparent ones; codecs.
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <functional>
#include <glm/geometric.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <nlohmann/json.hpp>

#include "cli/expect.h"
#include "ewa/image.h"
#include "ewa/splat_files.h"

namespace {

using namespace ewa;
using namespace ewa::test;
using Names = std::vector<std::string>;

struct Spot {
    glm::dvec2 middle{0};  // px
    double spread = 0;     // mean squared distance from it, px^2
};

/// The light of the first channel between two columns and two rows.
Spot spot_of(const Image& image, int left, int right, int top = 0, int bottom = -1) {
    if (bottom < 0) bottom = image.height;
    double sum = 0, squares = 0;
    glm::dvec2 places(0);
    for (int y = top; y < bottom; ++y)
        for (int x = left; x < right; ++x) {
            const glm::dvec2 p(x + 0.5 - left, y + 0.5 - top);
            const double v = *image.at(x, y);
            sum += v;
            places += v * p;
            squares += v * glm::dot(p, p);
        }
    const glm::dvec2 middle = places / sum;
    return {middle, squares / sum - glm::dot(middle, middle)};
}

class Pictures : public testing::Test {
  protected:
    void place(const std::vector<glm::vec3>& means) {
        Gaussians g;
        g.resize(means.size());
        for (size_t i = 0; i < means.size(); ++i) {
            for (size_t k = 0; k < 3; ++k) {
                g.means[3 * i + k] = means[i][int(k)];
                g.log_scales[3 * i + k] = -3.2f;
                g.sh[3 * i + k] = 1;
            }
            g.quaternions[4 * i] = 1;
        }
        save_splats(splats, g);
    }
    /// From the origin along z.
    Outcome render(const std::string& name, const Names& more) {
        Names arguments{"render", splats, "-o", folder / name, "--quiet"};
        if (std::ranges::find(more, "--orbit") == more.end())
            arguments.insert(arguments.end(), {"--look-at", "0,0,0,0,0,1", "--up=-y"});
        arguments.insert(arguments.end(), more.begin(), more.end());
        return run_ewa(arguments);
    }
    Image image(const std::string& name, const Names& more) {
        expect_success(render(name, more));
        return load_image(folder / name);
    }

    Folder folder;
    const std::string splats = folder / "s.ply";
};

const double kFocal = 60 / std::tan(25 * M_PI / 180);  // px, of a view 120 px high

TEST_F(Pictures, OutOfFocusIsADiscOfLight) {
    place({{-0.5f, 0, 3}, {1, 0, 6}});
    const Names size{"--size", "160x120", "--mode", "alpha"};
    const auto with = [&](Names more) {
        more.insert(more.end(), size.begin(), size.end());
        return more;
    };
    const Image sharp = image("sharp.exr", size);
    const Image blurred =
        image("blurred.exr", with({"--aperture", "0.4", "--focus", "3", "--blur-samples", "64"}));
    const Spot near = spot_of(blurred, 0, 80), far = spot_of(blurred, 80, 160);
    EXPECT_NEAR(near.spread, spot_of(sharp, 0, 80).spread, 0.1) << "in focus";
    const double radius = 0.2 * kFocal * (1 / 3.0 - 1 / 6.0);
    EXPECT_NEAR(far.spread - spot_of(sharp, 80, 160).spread, radius * radius / 2, 0.6);
    EXPECT_LT(glm::distance(far.middle, spot_of(sharp, 80, 160).middle), 0.3);

    // Without --focus, what the middle shows is sharp.
    place({{0, 0, 3}, {2, 0, 6}});
    const Image found = image("found.exr", with({"--aperture", "0.4"}));
    EXPECT_NEAR(spot_of(found, 40, 100).spread, spot_of(image("s.exr", with({})), 40, 100).spread, 0.1);
    place({{-0.5f, 0, 3}});
    expect_failure(render("x.exr", with({"--aperture", "0.4"})), 2, "--focus is needed");
}

TEST_F(Pictures, MotionBlurIsTheMeanOverTheShutter) {
    place({{-0.5f, 0, 0}, {1, 0, 0.4f}, {0, 0.4f, -0.7f}});
    const Names size{"--size", "90x60", "--format", "exr", "--mode", "alpha"};
    const auto orbit = [&](const std::string& name, Names more) {
        more.insert(more.end(), size.begin(), size.end());
        expect_success(render(name, more));
        return [this, name](const std::string& file) { return load_image(folder / (name + "/" + file)); };
    };
    const auto fine = orbit("fine", {"--orbit", "64"});
    // Also the last view of an orbit, which goes on to the first, and that of a short one are on the circle.
    struct Case {
        const char *views, *file;
        std::array<const char*, 4> moments;
    };
    const Case cases[] = {{"16", "00003.exr", {"00012.exr", "00013.exr", "00014.exr", "00015.exr"}},
                          {"16", "00015.exr", {"00060.exr", "00061.exr", "00062.exr", "00063.exr"}},
                          {"4", "00001.exr", {"00016.exr", "00020.exr", "00024.exr", "00028.exr"}}};
    for (const Case& one : cases) {
        SCOPED_TRACE(std::string(one.views) + " " + one.file);
        const auto blurred = orbit(std::string("blurred") + one.views,
                                   {"--orbit", one.views, "--shutter", "1", "--blur-samples", "4"});
        const Image got = blurred(one.file);
        std::vector<Image> moments;
        for (const char* name : one.moments) moments.push_back(fine(name));
        double error = 0, moved = 0;
        for (size_t i = 0; i < got.pixels.size(); ++i) {
            double mean = 0;
            for (const Image& moment : moments) mean += 0.25 * moment.pixels[i];
            error = std::max(error, std::abs(mean - got.pixels[i]));
            moved = std::max(moved, std::abs(mean - moments[0].pixels[i]));
        }
        EXPECT_LT(error, 0.003);
        EXPECT_GT(moved, 0.1);
    }
}

TEST_F(Pictures, TheFocusIsOnASurfaceAndThatOfAnotherViewWhereThereIsNone) {
    // An opaque splat before another one: the mean depth is of neither.
    Gaussians g;
    g.resize(2);
    g.means = {0, 0, 3, 0, 0, 9};
    g.log_scales = {-2, -2, -2, 0, 0, 0};
    g.quaternions = {1, 0, 0, 0, 1, 0, 0, 0};
    g.opacity_logits = {1, 4};
    g.sh = {1.5f, 1.5f, 1.5f, -1.5f, -1.5f, -1.5f};
    save_splats(splats, g);
    const auto edge = [&](const Names& more) {
        Names all{"--size", "90x60", "--aperture", "1", "--blur-samples", "16"};
        all.insert(all.end(), more.begin(), more.end());
        return image("i.exr", all);
    };
    const Image found = edge({});
    EXPECT_LT(compare_images(found, edge({"--focus", "3"})).max_error, 0.02);
    EXPECT_GT(compare_images(found, edge({"--focus", "4"})).max_error, 0.05);

    // Views of a batch whose middle is empty do not end it.
    place({{0, 0, 3}});
    const auto view = [](const char* name, double turn) {
        const double c = std::cos(turn), s = std::sin(turn);
        return nlohmann::json{
            {"file_path", name},
            {"transform_matrix", {{c, 0, s, 0}, {0, -1, 0, 0}, {s, 0, -c, 0}, {0, 0, 0, 1}}}};
    };
    nlohmann::json dataset = {{"fl_x", 60}, {"fl_y", 60}, {"cx", 40}, {"cy", 30}, {"w", 80}, {"h", 60}};
    dataset["frames"] = {view("a.png", 0.3), view("b.png", 0)};
    std::filesystem::create_directories(folder / "data");
    write_file(folder / "data/transforms.json", dataset.dump());
    expect_success(run_ewa({"render", splats, "--cameras", folder / "data", "--aperture", "0.3", "--quiet",
                            "--blur-samples", "2", "-o", folder / "batch"}));
    EXPECT_EQ(files_below(folder / "batch").size(), 2u);
}

TEST_F(Pictures, ATransparentImageGoesOverAnyBackground) {
    place({{-0.5f, 0, 3}, {1, 0, 6}});
    const Names size{"--size", "80x60"};
    const Image clear = image("clear.png", {"--size", "80x60", "--transparent"});
    ASSERT_EQ(clear.channels, 4);
    const Image over = over_background(clear, {0.2f, 0.6f, 0.4f});
    const Image rendered = image("rendered.png", {"--size", "80x60", "--background", "0.2,0.6,0.4"});
    EXPECT_LE(compare_images(over, rendered).max_error, 2.0 / 255);
    EXPECT_GT(compare_images(over, image("black.png", size)).max_error, 0.1);
    expect_failure(render("x.jpg", {"--transparent"}), 2, "has no alpha");
    expect_failure(render("x.png", {"--transparent", "--mode", "depth"}), 2, "--mode color");
}

TEST_F(Pictures, SizesOfScreensHaveNames) {
    place({{0, 0, 3}});
    EXPECT_EQ(image("p.png", {"--size", "720p"}).height, 720);
    EXPECT_EQ(image("q.png", {"--size", "720p", "--through", "equirectangular"}).height, 640);
    expect_failure(render("x.png", {"--size", "5k"}), 2, "--size");
}

TEST_F(Pictures, TheCodecIsOneThatFfmpegHas) {
    place({{0, 0, 3}});
    std::filesystem::create_directories(folder / "bin");
    write_file(
        folder / "bin/ffmpeg",
        "#!/bin/sh\nPATH=/usr/bin:/bin\ncase \"$*\" in\n*-encoders*) echo ' V....D librav1e  AV1'; "
        "echo ' V....D libx264rgb  RGB'; echo ' V....D libopenh264  H.264';;\n*) printf '%s\\n' \"$@\" > " +
            (folder / "arguments") + "\nfor last; do :; done\ncat > \"$last\";;\nesac\n");
    chmod((folder / "bin/ffmpeg").c_str(), 0755);
    const auto film = [&](const Names& more) {
        Names arguments{"render", splats, "-o", folder / "f.mp4", "--orbit", "2", "--size", "8x6"};
        arguments.insert(arguments.end(), more.begin(), more.end());
        return run_ewa(arguments, {.environment = {{"PATH", folder / "bin"}}});
    };
    expect_success(film({"--codec", "av1"}));
    EXPECT_NE(read_file(folder / "arguments").find("\n-c:v\nlibrav1e\n"), std::string::npos);
    // No encoder by a part of its name.
    expect_success(film({"--codec", "h264"}));
    EXPECT_NE(read_file(folder / "arguments").find("\n-c:v\nlibopenh264\n"), std::string::npos);
    expect_failure(film({"--codec", "vp9"}), 1, "libvpx-vp9");
    for (const auto& [name, codec] :
         {std::pair{"f.webm", "h264"}, {"f.webm", "hevc"}, {"f.mov", "vp9"}, {"f.mov", "av1"}})
        expect_failure(run_ewa({"render", splats, "-o", folder / name, "--codec", codec}), 2,
                       "has none of it");
    expect_success(film({}));
    EXPECT_EQ(read_file(folder / "arguments").find("-c:v"), std::string::npos);
    // Each frame is an average.
    expect_success(film({"--shutter", "0.5", "--blur-samples", "2"}));
    EXPECT_NE(read_file(folder / "arguments").find("\n8x6\n"), std::string::npos);
    EXPECT_EQ(read_file(folder / "f.mp4").size(), size_t(2) * 8 * 6 * 4);
}

TEST_F(Pictures, WrongUse) {
    place({{0, 0, 3}});
    const std::pair<Names, const char*> cases[] = {
        {{"--shutter", "0.5"}, "there is no motion"},
        {{"--focus", "2"}, "--focus needs"},
        {{"--aperture", "1", "--mode", "depth"}, "average colours"},
        {{"--aperture", "1", "--through", "equirectangular"}, "360"},
        {{"--aperture", "1", "--through", "fisheye:180"}, "pinhole"},
        {{"--codec", "av1"}, "only a film"}};
    for (const auto& [arguments, text] : cases) expect_failure(render("x.png", arguments), 2, text);
    EXPECT_FALSE(std::filesystem::exists(folder / "x.png"));
}

}  // namespace
