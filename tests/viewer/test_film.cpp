// SPDX-License-Identifier: Apache-2.0
// Films of the window: the times of their keys, their paths and their frames.
#include <sys/stat.h>

#include <cstdio>
#include <glm/geometric.hpp>

#include "ewa/error.h"
#include "scene/framing.h"
#include "support/soon.h"
#include "viewer/editor/film.h"
#include "viewer/opening.h"
#include "viewer/session.h"
#include "viewer/variable.h"

namespace ewa::viewer {
namespace {

using Views = std::vector<io::NamedView>;

/// Views along the x axis, without times.
Views views_at(const std::vector<double>& places) {
    Views views;
    for (const double x : places) {
        const Camera camera = scene::look_at({x, 0, -6}, {x, 0, 0}, {0, -1, 0}, 48, 32);
        views.push_back({std::to_string(views.size() + 1), camera, {}});
    }
    return views;
}

std::string order_of(const Views& views) {
    std::string names;
    for (const io::NamedView& view : views) names += view.name;
    return names;
}

TEST(FilmKeys, GetTimesAndStayApart) {
    Views views = views_at({0, 1, 2});
    give_times(views, 1.5);
    EXPECT_EQ(io::times_of(views, 0), (std::vector<double>{0, 1.5, 3}));
    views.push_back(views_at({9})[0]);
    views.back().name = "4";
    give_times(views, 2);
    EXPECT_EQ(views.back().time, 5);
    views[1].time = 9;
    give_times(views, 2);
    EXPECT_EQ(order_of(views), "1342");
    views[1].time = 0;
    give_times(views, 2);
    EXPECT_EQ(io::times_of(views, 0), (std::vector<double>{0, kLeastGap, 5, 9}));
}

TEST(FilmKeys, AreMovedSpacedAndStretched) {
    Views views = views_at({0, 1, 2});
    give_times(views, 1);
    EXPECT_EQ(move_key(views, 0, 1.5), 1u);
    EXPECT_EQ(order_of(views), "213");
    EXPECT_EQ(io::times_of(views, 0), (std::vector<double>{1, 1.5, 2}));
    EXPECT_EQ(move_key(views, 1, 1.99), 1u);
    EXPECT_EQ(views[1].time, 2 - kLeastGap) << "the next key stays";
    EXPECT_EQ(move_key(views, 0, -3), 0u);
    EXPECT_EQ(views[0].time, 0);
    space_evenly(views);
    EXPECT_EQ(io::times_of(views, 0), (std::vector<double>{0, 1, 2}));
    stretch(views, 8);
    EXPECT_EQ(io::times_of(views, 0), (std::vector<double>{0, 4, 8}));
}

TEST(FilmKeys, AreAddedAtThePlayhead) {
    Views views;
    EXPECT_EQ(time_for_key(views, 1e9, 2), 0);
    views = views_at({0, 1});
    give_times(views, 2);
    EXPECT_EQ(time_for_key(views, 2, 3), 5);
    EXPECT_EQ(time_for_key(views, 0.5, 3), 0.5);
    EXPECT_EQ(time_for_key(views, 0, 3), 1) << "there is a key";
}

TEST(FilmPath, HasFramesFromTheFirstKeyToTheLast) {
    Views views = views_at({0, 1, 4});
    const FilmPath even(views, 0.1);
    ASSERT_EQ(even.frames(30), 7);
    EXPECT_EQ(even.frame(3, 7).translation, views[1].camera.translation);
    EXPECT_EQ(even.frame(6, 7).translation, views[2].camera.translation);
    views[0].time = 1;
    views[1].time = 2;
    views[2].time = 2.5;
    const FilmPath path(views, 9, false);
    EXPECT_EQ(path.frames(24), 37);
    EXPECT_EQ(path.begin(), 1);
    EXPECT_NEAR(path.at(1.25).position().x, 0.25, 1e-12);
    EXPECT_NEAR(path.at(2.25).position().x, 2.5, 1e-12);
    EXPECT_NEAR(path.frame(18, 37).position().x, path.at(1.75).position().x, 1e-12);
    EXPECT_EQ(frame_file("film", 7), "film/00007.png");
    EXPECT_EQ(frame_file("film", 123456), "film/123456.png");
}

/// An ffmpeg that keeps its input as the film.
std::string fake_ffmpeg(const test::Folder& folder) {
    std::filesystem::create_directories(folder / "bin");
    test::write_file(folder / "bin/ffmpeg",
                     "#!/bin/sh\nPATH=/usr/bin:/bin\ncase \"$*\" in\n*-encoders*) echo ' V....D libx264  "
                     "H.264';;\n*) for last; do :; done\ncat > \"$last\";;\nesac\n");
    chmod((folder / "bin/ffmpeg").c_str(), 0755);
    return folder / "bin";
}

/// Renders the film to its end. Throws what the writer throws.
void write_film(FilmWriter& writer, Renders& renders) {
    double seconds = 0;
    EXPECT_TRUE(test::soon([&] { return writer.step(renders, renders.take().extras, seconds += 0.1); }));
}

TEST(FilmWriter, GivesFfmpegItsFrames) {
    const test::Folder folder;
    const test::Variable path("PATH", fake_ffmpeg(folder));
    PointCloud points;
    points.positions = {{0, 0, 0}};
    points.colors = {{255, 0, 0}};
    Renders renders([] { return open_device({}); }, [] {});
    renders.set_scene(std::make_shared<const Gaussians>(splats_of_points(points)));
    const FilmPath film(views_at({0, 1}), 0.1);
    FilmOutput output{.file = folder / "film.mp4", .size = {32, 24}};
    FilmWriter writer(film, output, {}, [] {});
    EXPECT_FALSE(writer.left(0));
    write_film(writer, renders);
    EXPECT_EQ(writer.written(), 4);
    EXPECT_EQ(test::read_file(folder / "film.mp4").size(), size_t(4) * 32 * 24 * 4);

    output.codec = "av1";
    EXPECT_THROW(FilmWriter(film, output, {}, [] {}), RunError) << "this ffmpeg has no encoder for it";
    output.file = folder / "frames";
    FilmWriter frames(film, output, {}, [] {});
    write_film(frames, renders);
    EXPECT_EQ(test::files_below(folder / "frames").size(), 4u);
    EXPECT_EQ(load_image(folder / "frames/00003.png").width, 32);
    // A film that is stopped leaves nothing.
    output = {.file = folder / "stopped.mp4", .size = {32, 24}};
    FilmWriter stopped(film, output, {}, [] {});
    EXPECT_FALSE(stopped.step(renders, {}, 0));
    EXPECT_FALSE(std::filesystem::exists(folder / "stopped.mp4"));
}

TEST(AKeyHistory, UndoesKeysAmongTheEditsOfSplats) {
    std::vector<io::NamedView> views = views_at({0, 1, 2});
    KeyHistory history;
    const KeyHistory::Place before{"a.ply", 3}, later{"a.ply", 4}, other{"b.ply", 3};
    EXPECT_FALSE(history.step(true, views, before)) << "nothing was changed";
    history.remember(views, before);
    views.pop_back();
    EXPECT_FALSE(history.step(true, views, later)) << "the edit is undone first";
    EXPECT_FALSE(history.step(true, views, other));
    EXPECT_EQ(views.size(), 2u);
    EXPECT_TRUE(history.step(true, views, before));
    EXPECT_EQ(views.size(), 3u);
    EXPECT_FALSE(history.step(true, views, before));
    EXPECT_TRUE(history.step(false, views, before));
    EXPECT_EQ(views.size(), 2u);
    EXPECT_TRUE(history.step(true, views, before));
    history.remember(views, before);
    space_evenly(views);
    EXPECT_FALSE(history.step(false, views, before)) << "another change was made";
}

}  // namespace
}  // namespace ewa::viewer

namespace ewa::test {
namespace {

using Input = SessionTest;

/// Two keys, half a second apart.
void film_two_keys(Session& session, const std::string& shots) {
    session.send("key k");
    session.screenshot();
    session.send("key Right key k");
    session.screenshot();
    session.send("key ctrl+k");
    session.screenshot();
    // A key that comes before the dialog has the focus is lost.
    constexpr int kTries = 6;
    bool there = false;
    for (int i = 0; i < kTries && !there; ++i) {
        session.send("key Return");
        there = soon([&] { return std::filesystem::exists(shots + "/ewa-film-1.mp4"); },
                     kSessionPatience / kTries);
    }
    ASSERT_TRUE(there);
}

TEST_F(Input, TwoKeysMakeAFilm) {
    std::filesystem::create_directories(config_ + "/ewa");
    write_file(config_ + "/ewa/view.json", "{\"film_seconds\": 0.5}");
    Session session(shots_, {splats_, "--cameras", cameras_, "--size", "640x480"},
                    {{"PATH", viewer::fake_ffmpeg(folder_)}});
    ASSERT_TRUE(session.found());
    film_two_keys(session, shots_);
    EXPECT_EQ(read_file(shots_ + "/ewa-film-1.mp4").size(), size_t(16) * 1920 * 1080 * 4);
    expect_silent(session.quit());
}

TEST_F(Input, FfmpegItselfMakesAFilmOfTwoKeys) {
    for (const char* program : {"/usr/bin/ffmpeg", "/usr/bin/ffprobe"})
        if (!std::filesystem::exists(program)) GTEST_SKIP() << "ffmpeg is not installed";
    std::filesystem::create_directories(config_ + "/ewa");
    write_file(config_ + "/ewa/view.json", "{\"film_seconds\": 0.5}");
    Session session(shots_, {splats_, "--cameras", cameras_, "--size", "640x480"});
    ASSERT_TRUE(session.found());
    film_two_keys(session, shots_);
    const std::string count = folder_ / "count";
    ASSERT_EQ(std::system(("/usr/bin/ffprobe -v error -count_frames -select_streams v -of csv=p=0 "
                           "-show_entries stream=nb_read_frames '" +
                           shots_ + "/ewa-film-1.mp4' > '" + count + "'")
                              .c_str()),
              0);
    EXPECT_EQ(std::stoi(read_file(count)), 16);
    expect_silent(session.quit());
}

}  // namespace
}  // namespace ewa::test
