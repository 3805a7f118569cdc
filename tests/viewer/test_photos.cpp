// SPDX-License-Identifier: Apache-2.0
// Photos and videos in the window, with programs in the place of COLMAP and ffmpeg.
#include <sys/stat.h>

#include "ewa/dataset.h"
#include "io/datasets/image_records.h"
#include "viewer/font.h"
#include "viewer/opening.h"
#include "viewer/session.h"

namespace ewa::test {
namespace {

namespace fs = std::filesystem;

class Photos : public SessionTest {
  protected:
    void SetUp() override {
        SessionTest::SetUp();
        if (IsSkipped()) return;
        give_points();
        fs::copy(cameras_ + "/images", photos_);
        const Dataset dataset = load_dataset(cameras_, {});
        std::vector<io::ImageRecord> images;
        for (const Frame& frame : dataset.frames)
            images.push_back({.name = fs::path(frame.name).filename(),
                              .path = {},
                              .camera = frame.camera,
                              .mask = {},
                              .depth = {},
                              .distortion = {},
                              .split = 0});
        io::write_colmap(folder_ / "model", images, dataset.points);
        make_program("colmap", R"sh(
case "$*" in *--help*) exit 0;; esac
if [ "$HANG" = "$1" ]; then echo begun > "$MODEL.hangs"; exec sleep 1000; fi
case $1 in
feature_extractor) touch "$3"; echo "Processed file [4/4]";;
mapper)
    previous=
    for word; do
        if [ "$previous" = --output_path ]; then output=$word; fi
        previous=$word
    done
    cp -r "$MODEL" "$output/0";;
esac
)sh");
    }
    void make_program(const std::string& name, const std::string& script) {
        fs::create_directories(bin_);
        write_file(bin_ + "/" + name, "#!/bin/sh\n" + script);
        chmod((bin_ + "/" + name).c_str(), 0755);
    }
    std::vector<std::pair<std::string, std::string>> environment(const std::string& hang = "") {
        return {{"PATH", bin_ + ":/usr/bin:/bin"}, {"MODEL", folder_ / "model"}, {"HANG", hang}};
    }
    bool titled(const std::string& title) {
        return XClient(display_.name()).window_titled(title + " - ewa").has_value();
    }

    const std::string photos_ = folder_ / "photos", bin_ = folder_ / "bin";
    const std::string dataset_ = shots_ + "/out/photos/dataset";
};

TEST_F(Photos, BecomeADatasetThatCanBeTrained) {
    if (viewer::find_font().empty()) GTEST_SKIP() << "the button has another place without a vector font";
    Session session(shots_, {photos_, "--size", "900x800"}, environment());
    ASSERT_TRUE(session.found());
    ASSERT_TRUE(session.awaited(dataset_ + "/sparse/0")) << "no cameras were found";
    EXPECT_TRUE(titled("photos"));
    EXPECT_TRUE(soon([&] { return range_of(screenshot(session)) > 0.3f; })) << "neither points nor cameras";
    act(session, {"mousemove 60 330", "click 1"});
    ASSERT_TRUE(session.awaited(shots_ + "/out/photos/live.json")) << "no training has started";
    EXPECT_EQ(read_json(shots_ + "/out/photos/config.json")["dataset"], photos_);
    EXPECT_FALSE(fs::exists(shots_ + "/out/photos-2"));
    expect_silent(session.quit());
}

TEST_F(Photos, OfferATrainingInThePicture) {
    if (viewer::find_font().empty()) GTEST_SKIP() << "the button has another place without a vector font";
    Session session(shots_, {photos_, "--size", "900x800"}, environment());
    ASSERT_TRUE(session.found());
    ASSERT_TRUE(session.awaited(dataset_ + "/sparse/0")) << "no cameras were found";
    EXPECT_TRUE(soon([&] { return range_of(screenshot(session)) > 0.3f; })) << "neither points nor cameras";
    act(session, {"mousemove 602 496", "click 1"});  // the middle button, "Good"
    ASSERT_TRUE(session.awaited(shots_ + "/out/photos/live.json")) << "no training has started";
    EXPECT_EQ(read_json(shots_ + "/out/photos/config.json")["steps"], 7000);
    expect_silent(session.quit());
}

TEST_F(Photos, AreTrainedOnAsTheCommandLineSays) {
    Session session(shots_, {"--train", photos_, "--steps", "20", "--quiet", "--size", "300x200"},
                    environment());
    ASSERT_TRUE(session.found());
    ASSERT_TRUE(session.awaited(shots_ + "/out/photos/summary.json")) << "the training has not ended";
    EXPECT_EQ(read_json(shots_ + "/out/photos/summary.json")["steps"], 20);
    expect_silent(session.quit());
}

TEST_F(Photos, CanBeDroppedAndStopped) {
    const XClient display(display_.name());
    Session session(shots_, {splats_, "--size", "500x300"}, environment("matches_importer"));
    ASSERT_TRUE(session.found());
    const auto window = display.window_titled("ewa");
    ASSERT_TRUE(window && display.drop(*window, uri_of(photos_)));
    ASSERT_TRUE(session.awaited(folder_ / "model.hangs"));
    const Image searching = display.pixels_at_rest(*window);
    session.send("key Escape");
    display.pixels_at_rest(*window, &searching);
    EXPECT_FALSE(fs::exists(dataset_ + "/sparse/0"));
    EXPECT_GT(range_of(screenshot(session)), 0.3f) << "the splats have gone";
    // It can be begun again, and ends with the window.
    fs::remove(folder_ / "model.hangs");
    ASSERT_TRUE(display.drop(*window, uri_of(photos_)));
    ASSERT_TRUE(session.awaited(folder_ / "model.hangs"));
    expect_silent(session.quit());
}

TEST_F(Photos, WithoutColmapSayWhatIsMissing) {
    fs::remove(bin_ + "/colmap");
    const XClient display(display_.name());
    Session session(shots_, {photos_, "--size", "640x480"}, {{"PATH", bin_}});
    ASSERT_TRUE(session.found());
    const auto window = display.window_titled("photos - ewa");
    ASSERT_TRUE(window);
    EXPECT_TRUE(soon([&] { return range_of(display.pixels(*window)) > 0.9f; })) << "nothing is said";
    EXPECT_FALSE(fs::exists(dataset_));
    act(session, {"key 2", "key 1"});
    expect_silent(session.quit());
}

TEST(WithoutWindow, PhotosNeedAWindow) {
    const Folder folder;
    make_dataset(folder / "views");
    fs::copy(folder / "views/images", folder / "photos");
    expect_failure(run_view({folder / "photos", "--screenshot", folder / "shown.png"}), 2,
                   "has no cameras yet; ewa cameras finds them");
    expect_failure(run_view({"--train", folder / "photos", "-o", folder / "run", "--step", "3"}), 2,
                   "did you mean --steps?");
}

TEST(Opening, PhotosAndVideosAreNotOpenedYet) {
    const Folder folder;
    make_dataset(folder / "views");
    fs::copy(folder / "views/images", folder / "photos");
    write_file(folder / "walk.mp4", "a video");
    make_splats(folder / "splats.ply");
    for (const char* name : {"photos", "walk.mp4"}) {
        const viewer::OpenedScene scene = viewer::open_scene(folder / name, {});
        EXPECT_EQ(scene.photos, folder / name);
        EXPECT_FALSE(scene.dataset);
        const viewer::OpenedScene shown = viewer::open_scene(folder / "splats.ply", {});
        EXPECT_EQ(viewer::open_dropped({folder / name}, shown).photos, folder / name);
    }
    EXPECT_EQ(viewer::open_dropped({folder / "splats.ply", folder / "photos"}, {}).photos, folder / "photos");
    EXPECT_EQ(viewer::open_scene(folder / "views", {}).photos, "");
    // Images of a dataset open it.
    EXPECT_TRUE(viewer::open_scene(folder / "views/images", {}).dataset);
    // A run's folder in which nothing was trained yet is the dataset in it.
    fs::create_directories(folder / "out/photos");
    fs::rename(folder / "views", folder / "out/photos/dataset");
    write_file(folder / "out/photos/dataset/capture.json", "{}");
    EXPECT_TRUE(viewer::open_scene(folder / "out/photos", {}).dataset);
}

}  // namespace
}  // namespace ewa::test
