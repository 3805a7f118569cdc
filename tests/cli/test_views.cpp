// SPDX-License-Identifier: Apache-2.0
// ewa render without a dataset: images, orbits, saved views and films.
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <algorithm>
#include <cmath>
#include <csignal>
#include <filesystem>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>
#include <glm/trigonometric.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <nlohmann/json.hpp>

#include "cli/expect.h"
#include "cli/faulty.h"
#include "ewa/image.h"
#include "ewa/splat_files.h"
#include "io/datasets/view_list.h"
#include "scene/framing.h"

namespace {

using namespace ewa;
using namespace ewa::test;
using Names = std::vector<std::string>;

class Views : public testing::Test {
  protected:
    void SetUp() override { make_splats(splats, 400); }
    Outcome render(const Names& more, const Circumstances& circumstances = {}) {
        Names arguments{"render", splats};
        arguments.insert(arguments.end(), more.begin(), more.end());
        return run_ewa(arguments, circumstances);
    }
    /// A program of the name ffmpeg that runs this script, and nothing else in $PATH.
    Circumstances with_ffmpeg(const std::string& script) {
        std::filesystem::create_directories(folder / "bin");
        write_file(folder / "bin/ffmpeg", "#!/bin/sh\nPATH=/usr/bin:/bin\n" + script);
        chmod((folder / "bin/ffmpeg").c_str(), 0755);
        return {.environment = {{"PATH", folder / "bin"}}};
    }
    /// The saved views as nerfstudio's viewer writes a path.
    std::string camera_path(nlohmann::json more = nlohmann::json::object()) {
        nlohmann::json path{
            {"camera_type", "perspective"}, {"render_width", 48}, {"render_height", 32}, {"fps", 12.5}};
        for (const io::NamedView& view : io::read_views(saved_views())) {
            const glm::dmat3 axes = glm::transpose(view.camera.rotation);
            const glm::dvec3 eye = view.camera.position();
            nlohmann::json values;
            for (int row = 0; row < 3; ++row)
                for (const double value : {axes[0][row], -axes[1][row], -axes[2][row], eye[row]})
                    values.push_back(value);
            for (const int value : {0, 0, 0, 1}) values.push_back(value);
            path["camera_path"].push_back({{"camera_to_world", values},
                                           {"fov", glm::degrees(2 * std::atan(16 / view.camera.fy))},
                                           {"aspect", 1.5}});
        }
        path.update(more);
        write_file(folder / "camera_path.json", path.dump());
        return folder / "camera_path.json";
    }
    /// Two cameras of 48 x 32 px in a file of saved views.
    std::string saved_views() {
        const Camera a = scene::look_at({0, 0, -6}, {0, 0, 0}, {0, -1, 0}, 48, 32);
        const Camera b = scene::look_at({6, 0, 0}, {0, 0, 0}, {0, -1, 0}, 48, 32);
        io::write_views(folder / "views.json", {{"1", a, {}}, {"2", b, {}}});
        return folder / "views.json";
    }

    Folder folder;
    const std::string splats = folder / "s.ply";
};

bool same_pixels(const std::string& a, const std::string& b) {
    const Image x = load_image(a), y = load_image(b);
    return x.width == y.width && x.height == y.height && x.pixels == y.pixels;
}

bool column_is_dark(const Image& image, int x) {
    for (int y = 0; y < image.height; ++y)
        if (*image.at(x, y) > 0.02f) return false;
    return true;
}

TEST_F(Views, NamesOfOtherImagesAndFilmsAreRefused) {
    for (const char* name : {"x.GIF", "x.webp", "x.tif", "x.avi"}) {
        expect_failure(render({"-o", folder / name}), 2, "an image is .png, .jpg or .exr, a film .mp4");
        EXPECT_FALSE(std::filesystem::exists(folder / name));
    }
}

TEST_F(Views, AFileAloneIsAnImageOfTheWholeScene) {
    const Outcome outcome = render({"-o", folder / "new/x.png", "--size", "90x60"});
    expect_success(outcome);
    EXPECT_NE(outcome.out.find("90x60"), std::string::npos) << outcome.out;
    const Image image = load_image(folder / "new/x.png");
    EXPECT_EQ(image.width, 90);
    EXPECT_EQ(image.height, 60);
    EXPECT_GT(*std::max_element(image.pixels.begin(), image.pixels.end()), 0.2f);
    EXPECT_TRUE(column_is_dark(image, 0) && column_is_dark(image, 89)) << "the scene is cut off";
    EXPECT_FALSE(column_is_dark(image, 45));

    expect_success(render({"-o", folder / "x.exr", "--size", "30x20", "--mode", "depth", "--quiet"}));
    const Image depth = load_image(folder / "x.exr");
    EXPECT_GT(*std::max_element(depth.pixels.begin(), depth.pixels.end()), 1.0f) << "view z in world units";
    expect_success(render({"-o", folder / "usual.png", "--quiet"}));
    EXPECT_EQ(load_image(folder / "usual.png").width, 1280);
}

/// The centre of the colours that lie above half of the brightest, px.
glm::dvec2 bright_place(const Image& image) {
    const float most = *std::ranges::max_element(image.pixels);
    glm::dvec2 sum(0);
    double count = 0;
    for (int y = 0; y < image.height; ++y)
        for (int x = 0; x < image.width; ++x)
            if (*image.at(x, y) > most / 2) sum += glm::dvec2(x + 0.5, y + 0.5), ++count;
    return sum / count;
}

TEST_F(Views, ThroughALens) {
    // A small splat to the left of a camera at the origin that looks along +x and down, with +z up.
    Gaussians one;
    one.resize(1);
    const glm::vec3 place(1, 5, 2);
    for (int i = 0; i < 3; ++i) one.means[size_t(i)] = place[i], one.log_scales[size_t(i)] = -2.5f;
    one.quaternions[0] = 1;
    one.opacity_logits[0] = 5;
    one.sh = {2, 2, 2};
    save_splats(splats, one);
    const Names view{"--look-at", "0,0,0,8,0,-2", "--up", "z"};
    const auto image = [&](const std::string& name, Names more) {
        more.insert(more.end(), view.begin(), view.end());
        more.insert(more.end(), {"-o", folder / name, "--quiet"});
        expect_success(render(more));
        return load_image(folder / name);
    };
    const Image all = image("all.png", {"--through", "equirectangular", "--size", "400x200"});
    // The horizon is level: longitude and latitude in the world.
    const double left = std::atan2(5.0, 1.0), above = std::atan2(2.0, std::hypot(1.0, 5.0));
    const glm::dvec2 expected(200 - 200 * left / M_PI, 100 - 200 * above / M_PI);
    EXPECT_LT(glm::distance(bright_place(all), expected), 0.6);
    EXPECT_NE(read_file(folder / "all.png").find("GPano:ProjectionType=\"equirectangular\""),
              std::string::npos);
    EXPECT_EQ(image("usual.jpg", {"--through", "equirectangular"}).width, 2048);
    EXPECT_NE(read_file(folder / "usual.jpg").find("GPano:FullPanoWidthPixels=\"2048\""), std::string::npos);

    EXPECT_EQ(image("depth.jpg", {"--mode", "depth", "--through", "fisheye:200", "--size", "30x20"}).width,
              30)
        << "a grey JPEG";

    const Image fisheye = image("fisheye.png", {"--through", "fisheye:200", "--size", "300x200"});
    const glm::dvec3 axis = glm::normalize(glm::dvec3(4, 0, -1));
    const double angle = std::acos(glm::dot(axis, glm::normalize(glm::dvec3(place))));
    EXPECT_NEAR(glm::distance(bright_place(fisheye), glm::dvec2(150, 100)), glm::degrees(angle), 0.6)
        << "px for a degree: 200 px show 200 degrees";
    EXPECT_EQ(read_file(folder / "fisheye.png").find("GPano"), std::string::npos);

    const Image parallel = image("parallel.png", {"--through", "orthographic", "--size", "300x200"});
    const glm::dvec3 beside = glm::normalize(glm::cross(axis, glm::dvec3(0, 0, 1)));
    const glm::dvec2 at = bright_place(parallel) - glm::dvec2(150, 100);
    const double right = glm::dot(beside, glm::dvec3(place)),
                 up = glm::dot(glm::cross(beside, axis), glm::dvec3(place));
    EXPECT_NEAR(at.y / at.x, -up / right, 0.02);
}

TEST_F(Views, WordsThatAreNoLens) {
    for (const char* lens :
         {"fisheye:0", "fisheye:361", "fisheye:x", "equirectangular:2", "tele", "opencv:1,2,3", ""})
        expect_failure(render({"-o", folder / "x.png", "--through", lens}), 2, "--through:");
    for (const char* lens : {"fisheye:1e-30", "opencv:1e300"})
        expect_failure(render({"-o", folder / "x.png", "--through", lens}), 2, "--through: ");
    const Outcome at_length = render({"-o", folder / "x.png", "--through", std::string(3000, 'x')});
    expect_failure(at_length, 2, "--through: 'xxx");
    EXPECT_LT(at_length.err.size(), 300u);
    for (const std::string lens : {"native", "undistort"})
        expect_failure(render({"-o", folder / "x.png", "--lens", lens}), 2, "--lens needs --cameras DATASET");
}

TEST_F(Views, TheMarkOfAntialiasingIsUsed) {
    expect_success(render({"-o", folder / "peak.png", "--size", "40x40"}));
    SaveOptions marked{.comments = {"SplatRenderMode: mip"}, .antialiased = true};
    save_splats(folder / "marked.ply", load_splats(splats), marked);
    const auto image = [&](const std::string& name, const Names& more) {
        Names arguments{"render", folder / "marked.ply", "-o", folder / name, "--size", "40x40"};
        arguments.insert(arguments.end(), more.begin(), more.end());
        expect_success(run_ewa(arguments));
        return folder / name;
    };
    const std::string marked_image = image("marked.png", {});
    EXPECT_TRUE(same_pixels(marked_image, image("antialias.png", {"--kernel", "antialias"})));
    EXPECT_FALSE(same_pixels(marked_image, folder / "peak.png"));
    EXPECT_TRUE(same_pixels(image("given.png", {"--kernel", "peak"}), folder / "peak.png"));
    // Through the cameras of a dataset too.
    const std::string data = folder / "data", file = folder / "marked.ply";
    make_dataset(data);
    const auto text = [&](const Names& arguments) {
        const Outcome outcome = run_ewa(arguments);
        expect_success(outcome);
        return outcome.out.substr(0, outcome.out.find("mean"));
    };
    const Names eval{"eval", file, data, "--split", "all"};
    const auto with = [](Names arguments, const Names& more) {
        arguments.insert(arguments.end(), more.begin(), more.end());
        return arguments;
    };
    EXPECT_EQ(text(eval), text(with(eval, {"--kernel", "antialias"})));
    EXPECT_NE(text(eval), text(with(eval, {"--kernel", "peak"})));
    const Names frame{"render", file, "--cameras", data, "--frames", "0", "--quiet", "-o"};
    text(with(frame, {folder / "f.png"}));
    text(with(frame, {folder / "g.png", "--kernel", "antialias"}));
    EXPECT_TRUE(same_pixels(folder / "f.png", folder / "g.png"));
    text({"render", file, "--cameras", data, "--kernel", "antialias", "--format", "exr", "--quiet", "-o",
          folder / "all"});
    text({"compare", file, folder / "all", "--cameras", data, "--max-error", "1e-6"});
    // What has no footprints ignores it.
    image("ray.png", {"--integrator", "ray"});
    image("points.png", {"--points"});
}

TEST_F(Views, AnOrbitIsAFolder) {
    expect_success(render({"--orbit", "4", "-o", folder / "round", "--size", "40x30"}));
    EXPECT_EQ(files_below(folder / "round"), (Names{"00000.png", "00001.png", "00002.png", "00003.png"}));
    EXPECT_FALSE(same_pixels(folder / "round/00000.png", folder / "round/00002.png"));

    // From the eye that --look-at names. After half a turn it is at the other side.
    expect_success(
        render({"--orbit", "2", "-o", folder / "two", "--size", "40x30", "--look-at", "0,0,-5,0,0,0"}));
    expect_success(render({"-o", folder / "back.png", "--size", "40x30", "--look-at", "0,0,5,0,0,0"}));
    const ImageDifference difference =
        compare_images(load_image(folder / "two/00001.png"), load_image(folder / "back.png"));
    EXPECT_LE(difference.max_error, 1.001 / 255);
}

TEST_F(Views, LookAtIsTheSameAsASavedView) {
    const std::string views = saved_views();
    expect_success(render({"--views", views, "-o", folder / "saved"}));
    EXPECT_EQ(files_below(folder / "saved"), (Names{"00000.png", "00001.png"}));
    expect_success(
        render({"--look-at", "6,0,0,0,0,0", "--up=-y", "--size", "48x32", "-o", folder / "x.png"}));
    EXPECT_TRUE(same_pixels(folder / "saved/00001.png", folder / "x.png"));
    expect_success(
        render({"--look-at", "6,0,0,0,0,0", "--up", "z", "--size", "48x32", "-o", folder / "z.png"}));
    EXPECT_FALSE(same_pixels(folder / "z.png", folder / "x.png"));

    expect_success(render({"--views", views, "-o", folder / "large", "--size", "96x64", "--quiet"}));
    EXPECT_EQ(load_image(folder / "large/00000.png").width, 96);
    // The frames of a film: 3 a tenth of a second, from the first view to the last.
    expect_success(render({"--views", views, "--film-seconds", "0.1", "-o", folder / "film"}));
    EXPECT_EQ(files_below(folder / "film").size(), 4u);
    EXPECT_TRUE(same_pixels(folder / "film/00000.png", folder / "saved/00000.png"));
    EXPECT_TRUE(same_pixels(folder / "film/00003.png", folder / "saved/00001.png"));
    // Motion blur is also in the last of them.
    expect_success(render({"--views", views, "--film-seconds", "0.1", "-o", folder / "blurred", "--shutter",
                           "1", "--blur-samples", "2"}));
    EXPECT_FALSE(same_pixels(folder / "blurred/00003.png", folder / "film/00003.png"));
    // A film of one view stands still.
    io::write_views(views, {io::read_views(views)[0]});
    expect_failure(
        render({"--views", views, "--film-seconds", "0.1", "-o", folder / "one", "--shutter", "1"}), 2,
        "no motion");
}

TEST_F(Views, AFilmGoesToFfmpegFrameByFrame) {
    // Keeps its arguments, and its input as the film, which its last argument names.
    const Circumstances ffmpeg = with_ffmpeg("printf '%s\\n' \"$@\" > " + (folder / "arguments") +
                                             "\nfor last; do :; done\ncat > \"$last\"\n");
    expect_success(
        render({"--views", saved_views(), "--film-seconds", "0.1", "-o", folder / "a film.mp4"}, ffmpeg));
    const std::string frames = read_file(folder / "a film.mp4"), words = read_file(folder / "arguments");
    ASSERT_EQ(frames.size(), size_t(4) * 48 * 32 * 4);
    EXPECT_NE(words.find("\n48x32\n"), std::string::npos) << words;
    // The views' own times, where they have some.
    std::vector<io::NamedView> views = io::read_views(saved_views());
    views[0].time = 1;
    views[1].time = 1.2;
    io::write_views(folder / "timed.json", views);
    expect_success(render({"--views", folder / "timed.json", "-o", folder / "timed.mp4"}, ffmpeg));
    EXPECT_EQ(read_file(folder / "timed.mp4").size(), size_t(7) * 48 * 32 * 4);
    EXPECT_NE(words.find("\n30\n"), std::string::npos) << words;
    expect_success(render({"--views", saved_views(), "-o", folder / "saved"}));
    const Image first = load_image(folder / "saved/00000.png");
    for (size_t i = 0; i < first.pixels.size(); ++i)
        ASSERT_NEAR(first.pixels[i], uint8_t(frames[i / 3 * 4 + i % 3]) / 255.0f, 1.001f / 255) << i;

    // Without views a film goes once round the scene.
    expect_success(render({"--size", "8x6", "-o", folder / "round.webm", "--quiet"}, ffmpeg));
    EXPECT_EQ(read_file(folder / "round.webm").size(), size_t(240) * 8 * 6 * 4);
    expect_success(render({"--size", "8x6", "--orbit", "5", "-o", folder / "short.mkv"}, ffmpeg));
    EXPECT_EQ(read_file(folder / "short.mkv").size(), size_t(5) * 8 * 6 * 4);
}

/// One line says it, also of many views, and where the scene is.
TEST_F(Views, ThatShowNothingAreSaid) {
    const auto warned = [&](const Names& more, const std::string& text,
                            const Circumstances& circumstances = {}) {
        const Outcome outcome = render(more, circumstances);
        EXPECT_EQ(outcome.status, 0) << outcome.err;
        EXPECT_NE(outcome.err.find(text), std::string::npos) << "'" << text << "' is not in: " << outcome.err;
        EXPECT_EQ(std::ranges::count(outcome.err, '\n'), 1) << outcome.err;
        EXPECT_NE(outcome.err.find(": the scene is within "), std::string::npos) << outcome.err;
    };
    const Names away{"--look-at", "1000,0,0,2000,0,0", "--size", "24x16"};
    const auto with = [&](Names more) {
        more.insert(more.begin(), away.begin(), away.end());
        return more;
    };
    for (const char* mode : {"color", "alpha", "depth", "normal"})
        warned(with({"-o", folder / "x.png", "--mode", mode}), "x.png shows no splat");
    warned(with({"-o", folder / "x.exr", "--mode", "median-depth"}), "x.exr shows no surface");
    warned(with({"-o", folder / "x.png", "--through", "orthographic"}), "x.png shows no splat");
    warned(with({"-o", folder / "x.png", "--background", "1,1,1"}), "x.png shows no splat");
    warned(with({"-o", folder / "x.png", "--integrator", "march"}), "x.png shows no splat");
    warned(with({"-o", folder / "x.png", "--points"}), "x.png shows no splat");
    // An orbit about a point far away.
    warned({"--look-at", "1000,0,0,1001,0,0", "--orbit", "4", "--size", "24x16", "-o", folder / "d"},
           "of 4 views show no splat, the first is ");
    warned({"--look-at", "1000,0,0,1001,0,0", "--orbit", "4", "--size", "24x16", "-o", folder / "f.mp4"},
           "show no splat, the first is view ", with_ffmpeg("for last; do :; done\ncat > \"$last\"\n"));
    // Some of a folder's views.
    const Camera sees = scene::look_at({0, 0, -6}, {0, 0, 0}, {0, -1, 0}, 48, 32);
    const Camera not_any = scene::look_at({0, 0, -900}, {0, 0, -1000}, {0, -1, 0}, 48, 32);
    io::write_views(folder / "three.json", {{"1", sees, {}}, {"2", not_any, {}}, {"3", not_any, {}}});
    warned({"--views", folder / "three.json", "-o", folder / "d"},
           "2 of 3 views show no splat, the first is " + (folder / "d/00001.png"));
    expect_success(render({"--views", saved_views(), "-o", folder / "d"}));
}

TEST_F(Views, AFilmThatFailsIsOneLineAndLeavesNothing) {
    const Names film{"--orbit", "3", "--size", "300x200", "-o", folder / "film.mp4"};
    const Circumstances none{.environment = {{"PATH", folder / "nowhere"}}};
    const Outcome missing = render(film, none);
    expect_failure(missing, 1, "apt install ffmpeg");
    EXPECT_NE(missing.err.find("PNG"), std::string::npos) << missing.err;

    // It ends before it has read a frame, and its last line is the reason.
    expect_failure(render(film, with_ffmpeg("echo noise >&2; echo 'Unknown encoder' >&2; exit 1\n")), 1,
                   "ffmpeg failed: Unknown encoder");
    expect_failure(render(film, with_ffmpeg("cat > /dev/null; exit 3\n")), 1, "exit status 3");
    expect_failure(render(film, with_ffmpeg("cat > /dev/null\n")), 1, "no film");
    expect_failure(render(film, with_ffmpeg("kill -9 $$\n")), 1, "signal 9");
    write_file(folder / "film.mp4", "before");
    expect_failure(render(film, with_ffmpeg("for last; do :; done\necho half > \"$last\"\nexit 1\n")), 1,
                   "exit status 1");
    EXPECT_EQ(read_file(folder / "film.mp4"), "before");
}

TEST_F(Views, FfmpegItselfMakesAFilm) {
    if (!std::filesystem::exists("/usr/bin/ffmpeg")) GTEST_SKIP() << "ffmpeg is not installed";
    expect_success(render({"--orbit", "10", "--size", "65x49", "-o", folder / "film.mp4"}));
    const std::string bytes = read_file(folder / "film.mp4");
    ASSERT_GT(bytes.size(), 500u);
    EXPECT_EQ(bytes.substr(4, 4), "ftyp");
}

TEST_F(Views, WrongUse) {
    const std::string out = folder / "x.png", views = saved_views();
    write_file(folder / "none.json", R"({"views": []})");
    const std::pair<Names, const char*> cases[] = {
        {{"--size", "90", "-o", out}, "--size"},
        {{"--size", "0x90", "-o", out}, "--size"},
        {{"--size", "90x99999", "-o", out}, "--size"},
        {{"--look-at", "1,2,3", "-o", out}, "six numbers"},
        {{"--look-at", "1,2,3,4,5,x", "-o", out}, "six numbers"},
        {{"--look-at", "1,2,3,4,5,6,7", "-o", out}, "six numbers"},
        {{"--look-at", "1,2,nan,4,5,6", "-o", out}, "six numbers"},
        {{"--look-at", "1,2,3,1,2,3", "-o", out}, "--look-at"},
        {{"--up", "w", "-o", out}, "--up"},
        {{"--orbit", "3", "-o", out}, "name a folder"},
        {{"--orbit", "0", "-o", folder / "d"}, "--orbit"},
        {{"--views", views, "-o", out}, "2 views"},
        {{"--views", views, "--orbit", "3", "-o", folder / "d"}, "--orbit"},
        {{"--views", folder / "none.json", "-o", folder / "d"}, "no views"},
        {{"--views", folder / "nowhere.json", "-o", folder / "d"}, "nowhere.json"},
        {{"--film-seconds", "1", "-o", folder / "d"}, "--views"},
        {{"--size", "9x9", "--cameras", folder / "d"}, "--cameras"},
        {{"--frames", "test", "-o", out}, "--frames needs --cameras"},
        {{"--mode", "depth", "-o", folder / "film.mp4"}, "--mode color"},
        {{"--mode", "normal", "--points", "-o", out}, "--points"},
        {{"--mode", "median-depth", "--integrator", "ray", "-o", out}, "integrator splat"},
    };
    for (const auto& [arguments, text] : cases) expect_failure(render(arguments), 2, text);
    std::filesystem::create_symlink(views, folder / "link.png");
    expect_failure(render({"--views", views, "-o", folder / "link.png", "--size", "9x9"}), 2, "--views");
    EXPECT_EQ(files_below(folder / ".").size(), 4u) << "a refused command wrote a file";
}

TEST_F(Views, AFolderOfViewsReplacesNoInput) {
    const std::string views = saved_views(), out = folder / "d";
    std::filesystem::create_directory(out);
    const std::string first = out + "/00000.png";
    const auto keeps = [&](const Names& arguments, const char* text) {
        const std::string before = read_file(first);
        expect_failure(run_ewa(arguments), 2, text);
        EXPECT_EQ(read_file(first), before);
        EXPECT_EQ(files_below(out), Names{"00000.png"});
    };
    std::filesystem::copy_file(splats, first);
    keeps({"render", first, "--orbit", "2", "--size", "8x8", "-o", out}, "is the same file as SPLATS");
    std::filesystem::copy_file(views, first, std::filesystem::copy_options::overwrite_existing);
    keeps({"render", splats, "--views", first, "-o", out}, "is the same file as --views");
    // What cannot be written is found before the first render; what a killed render left is removed.
    std::filesystem::remove(first);
    ASSERT_EQ(mkfifo((out + "/00001.png").c_str(), 0600), 0);
    expect_failure(render({"--orbit", "2", "--size", "8x8", "-o", out}), 1, "00001.png");
    EXPECT_FALSE(std::filesystem::exists(first));
    std::filesystem::remove(out + "/00001.png");
    expect_failure(render({"--orbit", "2", "--size", "8x8", "-o", splats}), 2,
                   "is no folder; an image is .png");
    const Outcome killed =
        render({"--orbit", "2", "--size", "8x8", "-o", out}, with_fault("EWA_FAULT_KILL", "2"));
    ASSERT_EQ(killed.status, 128 + SIGKILL);
    EXPECT_EQ(files_below(out).size(), 1u);
    expect_success(render({"--orbit", "2", "--size", "8x8", "-o", out}));
    EXPECT_EQ(files_below(out), (Names{"00000.png", "00001.png"}));
}

TEST_F(Views, APathOfNerfstudiosViewer) {
    expect_success(render({"--cameras", camera_path(), "-o", folder / "path"}));
    EXPECT_EQ(files_below(folder / "path"), (Names{"00000.png", "00001.png"}));
    expect_success(render({"--views", saved_views(), "-o", folder / "saved"}));
    for (const std::string& name : files_below(folder / "path")) {
        const Image a = load_image(folder / "path/" + name), b = load_image(folder / "saved/" + name);
        ASSERT_EQ(a.pixels.size(), b.pixels.size());
        for (size_t i = 0; i < a.pixels.size(); ++i)
            ASSERT_NEAR(a.pixels[i], b.pixels[i], 1.001f / 255) << name << i;
    }
    expect_success(render({"--cameras", camera_path(), "--frames", "1", "-o", folder / "one.png"}));
    EXPECT_TRUE(same_pixels(folder / "one.png", folder / "path/00001.png"));
    // A film has the rate of the path.
    const Circumstances ffmpeg = with_ffmpeg("printf '%s\\n' \"$@\" > " + (folder / "arguments") +
                                             "\nfor last; do :; done\ncat > \"$last\"\n");
    const Outcome film = render({"--cameras", camera_path(), "-o", folder / "film.mp4"}, ffmpeg);
    expect_success(film);
    EXPECT_NE(film.out.find("2 frames, 0.2 s"), std::string::npos) << film.out;
    EXPECT_EQ(read_file(folder / "film.mp4").size(), size_t(2) * 48 * 32 * 4);
    EXPECT_NE(read_file(folder / "arguments").find("\n12.5\n"), std::string::npos);
    expect_success(render(
        {"--cameras", camera_path(), "--shutter", "1", "--blur-samples", "2", "-o", folder / "blurred"}));
    EXPECT_FALSE(same_pixels(folder / "blurred/00001.png", folder / "path/00001.png"));
    expect_failure(render({"--cameras", camera_path(), "--mode", "depth", "-o", folder / "film.mp4"}), 2,
                   "--mode color");
    // Other lenses than a pinhole.
    expect_success(
        render({"--cameras", camera_path({{"camera_type", "equirectangular"}, {"render_height", 24}}), "-o",
                folder / "round"}));
    EXPECT_EQ(load_image(folder / "round/00000.png").height, 24);
    expect_success(
        render({"--cameras", camera_path({{"camera_type", "fisheye"}}), "-o", folder / "fisheye"}));
    EXPECT_EQ(load_image(folder / "fisheye/00000.png").width, 48);
    expect_failure(render({"--cameras", camera_path({{"camera_path", nullptr}}), "-o", folder / "none"}), 2,
                   "\"camera_path\" is missing");
    expect_success(run_ewa({"info", camera_path()}));
    expect_failure(run_ewa({"train", camera_path(), "-o", folder / "run"}), 2,
                   "is a path of cameras without images");
}

/// One frame of a dataset, and the photographs beside which nothing is written.
TEST_F(Views, AFrameOfADatasetIsAnImage) {
    const std::string data = folder / "data";
    make_dataset(data);
    expect_success(render({"--cameras", data, "-o", folder / "all"}));
    const std::string one = folder / "new/one.png";
    expect_success(render({"--cameras", data, "--frames", "2", "-o", one}));
    EXPECT_TRUE(same_pixels(one, folder / "all/2.png"));
    expect_success(render({"--cameras", data, "--frames", "2", "-o", folder / "one.exr"}));
    EXPECT_EQ(load_image(folder / "one.exr").channels, 4);
    expect_failure(render({"--cameras", data, "-o", one}), 2, "there are 4 frames; choose one with --frames");
    expect_failure(render({"--cameras", data, "-o", folder / "x.mp4"}), 2, "a film goes round the scene");
    const Names before = files_below(data);
    for (const char* name : {"data/images", "data/images/new.png"})
        expect_failure(render({"--cameras", data, "--frames", "2", "-o", folder / name}), 2,
                       "is a folder of a dataset");
    EXPECT_EQ(files_below(data), before);

    // A run knows its dataset.
    const std::string run = folder / "run";
    expect_success(run_ewa({"train", data, "-o", run, "--steps", "1", "--quiet"}));
    expect_success(run_ewa({"render", run, "--frames", "2", "-o", folder / "of_run.png"}));
    expect_success(run_ewa({"render", run, "-o", folder / "all_of_run"}));
    EXPECT_TRUE(same_pixels(folder / "of_run.png", folder / "all_of_run/2.png"));
    expect_failure(run_ewa({"render", run, "--orbit", "2", "-o", folder / "data/images"}), 2,
                   "is a folder of a dataset");
}

}  // namespace
