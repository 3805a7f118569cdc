// SPDX-License-Identifier: Apache-2.0
// What else lies among photos, films in folders, photos of other formats, and programs that misbehave.
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <filesystem>

#include "capture/feature_database.h"
#include "cli/cameras_test.h"
#include "ewa/dataset.h"
#include "ewa/image.h"
#include "support/colmap_database.h"

namespace {

using namespace ewa::test;
namespace fs = std::filesystem;

class PhotoFolders : public CamerasTest {
  protected:
    void SetUp() override {
        CamerasTest::SetUp();
        make_model("0", {"0.png", "1.png", "2.png", "3.png"});
    }
    Outcome find(const std::string& input) {
        return run({"cameras", folder_ / input, "-o", folder_ / "dataset"});
    }
    void expect_searched(const std::string& names) {
        EXPECT_EQ(read_file(folder_ / "dataset/colmap/photos.txt"), names);
    }
    /// A mask that keeps the left half.
    void write_mask(const std::string& path, float kept = 1) {
        ewa::Image mask(48, 32, 1);
        for (int y = 0; y < 32; ++y)
            for (int x = 0; x < 24; ++x) *mask.at(x, y) = kept;
        fs::create_directories(fs::path(path).parent_path());
        save_image(path, mask);
    }
    void expect_half(const std::string& path) {
        const ewa::Image mask = ewa::load_image(path);
        ASSERT_EQ(mask.width, 48);
        EXPECT_EQ(*mask.at(23, 5), 1.0f);
        EXPECT_EQ(*mask.at(24, 5), 0.0f);
    }
};

const std::string kFour = "0.png\n1.png\n2.png\n3.png\n";

TEST_F(PhotoFolders, MayHaveTheFilesOfDesktops) {
    for (const char* name :
         {"._0.png", ".trashed-1.jpg", "__MACOSX/._0.jpg", ".thumbnails/0.jpg", "@eaDir/0.jpg"})
        write_file(folder_ / "photos/" + name, "Mac OS X");
    for (const char* name : {".DS_Store", "Thumbs.db"}) write_file(folder_ / "photos/" + name, "a desktop's");
    const Outcome outcome = find("photos");
    ASSERT_EQ(outcome.status, 0) << outcome.err;
    EXPECT_EQ(outcome.out.find("cannot be used"), std::string::npos) << outcome.out;
    expect_searched(kFour);
}

TEST_F(PhotoFolders, MayHaveMasksAndDepthMaps) {
    fs::create_directories(folder_ / "project");
    fs::rename(folder_ / "photos", folder_ / "project/photos");
    for (const char* name : {"0", "1", "2", "3"}) {
        write_mask(folder_ / "project/masks/" + name + ".png");
        write_mask(folder_ / "project/depth_maps/" + name + ".png");
        write_mask(folder_ / "project/photos/" + name + "_seg.png");
    }
    const Outcome outcome = find("project");
    ASSERT_EQ(outcome.status, 0) << outcome.err;
    EXPECT_NE(outcome.out.find("4 of 4 photos have masks"), std::string::npos) << outcome.out;
    EXPECT_NE(outcome.out.find("4 pictures are not searched"), std::string::npos) << outcome.out;
    expect_searched(kFour);
}

/// Pictures that are called masks, and are all that there is, are photos.
TEST_F(PhotoFolders, OfMasksAloneArePhotos) {
    fs::create_directories(folder_ / "carnival");
    fs::rename(folder_ / "photos", folder_ / "carnival/masks");
    fs::remove_all(folder_ / "models");
    make_model("0", {"masks/0.png", "masks/1.png", "masks/2.png", "masks/3.png"});
    ASSERT_EQ(find("carnival").status, 0);
    EXPECT_FALSE(fs::exists(folder_ / "dataset/masks"));
    expect_searched("masks/0.png\nmasks/1.png\nmasks/2.png\nmasks/3.png\n");
}

/// COLMAP and the training get masks under one name, whatever they are called. 0 and 1 mean black and white.
TEST_F(PhotoFolders, WithMasksAreSearchedAndTrainedWithThem) {
    fs::create_directories(folder_ / "project");
    fs::rename(folder_ / "photos", folder_ / "project/images");
    write_mask(folder_ / "project/masks/0.png");
    write_mask(folder_ / "project/masks/1.png.png", 1.0f / 255);
    write_mask(folder_ / "project/masks/2_mask.PNG.png");
    make_program(folder_ / "bin/masked", "echo \"$@\" >> \"$CALLS.words\"\nexec \"$0.real\" \"$@\"\n");
    fs::rename(folder_ / "bin/colmap", folder_ / "bin/colmap.real");
    fs::rename(folder_ / "bin/masked", folder_ / "bin/colmap");
    const Outcome outcome =
        run({"train", folder_ / "project", "-o", folder_ / "run", "--steps", "2", "--test-every", "0"});
    ASSERT_EQ(outcome.status, 0) << outcome.err;
    EXPECT_NE(outcome.out.find("3 of 4 photos have masks"), std::string::npos) << outcome.out;
    const std::string masks = folder_ / "run/dataset/masks";
    EXPECT_NE(read_file(folder_ / "calls.words").find("--ImageReader.mask_path " + masks), std::string::npos);
    for (const char* name : {"/0.png.png", "/1.png.png", "/2.png.png"}) expect_half(masks + name);
    const ewa::Dataset dataset = ewa::load_dataset(folder_ / "run/dataset", {});
    ASSERT_EQ(dataset.frames.size(), 4u);
    EXPECT_EQ(dataset.frames[0].mask_path.filename(), "0.png.png");
    EXPECT_EQ(dataset.frames[0].masks, ewa::MaskUse::ignore);
    EXPECT_TRUE(dataset.frames[3].mask_path.empty());

    // A mask that changes is copied again. One that was edited in the dataset stays.
    write_mask(masks + "/1.png.png", 0);
    ewa::Image white(48, 32, 1);
    std::ranges::fill(white.pixels, 1.0f);
    sleep(1);
    save_image(folder_ / "project/masks/0.png", white);
    ASSERT_EQ(run({"cameras", folder_ / "project", "-o", folder_ / "run/dataset"}).status, 0);
    EXPECT_EQ(*ewa::load_image(masks + "/0.png.png").at(40, 5), 1.0f);
    EXPECT_EQ(*ewa::load_image(masks + "/1.png.png").at(5, 5), 0.0f);
}

/// Two cameras give their photos the same names. Masks of one are none of the other, and are found as those of datasets.
TEST_F(PhotoFolders, HaveTheMasksOfTheirFolder) {
    const std::string project = folder_ / "project";
    for (const char* camera : {"/images/a", "/images/b"}) fs::create_directories(project + camera);
    for (const std::string name : {"0.png", "1.png"})
        for (const char* camera : {"a/", "b/"})
            fs::copy_file(folder_ / ("photos/" + name), project + "/images/" + camera + name);
    fs::remove_all(folder_ / "models");
    make_model("0", {"a/0.png", "a/1.png", "b/0.png", "b/1.png"});
    ewa::Image alpha(48, 32, 4);  // black, and white where its alpha is
    for (int y = 0; y < 32; ++y)
        for (int x = 0; x < 24; ++x) alpha.at(x, y)[3] = 1;
    fs::create_directories(project + "/masks/a");
    save_image(project + "/masks/a/0.png", alpha);
    write_mask(project + "/masks/a/mask_1.png");
    const auto said = [&](const std::string& line) {
        fs::remove_all(folder_ / "dataset");
        const Outcome outcome = find("project");
        ASSERT_EQ(outcome.status, 0) << outcome.err;
        EXPECT_NE(outcome.out.find(line), std::string::npos) << outcome.out;
        const Outcome info = run_ewa({"info", project});
        EXPECT_NE(info.out.find("kind            4 photos without cameras"), std::string::npos) << info.out;
        EXPECT_NE(info.out.find("\nmasks           " + line), std::string::npos) << info.out;
    };
    said("2 of 4 photos have masks: ");
    expect_half(folder_ / "dataset/masks/a/0.png.png");
    expect_half(folder_ / "dataset/masks/a/1.png.png");
    EXPECT_FALSE(fs::exists(folder_ / "dataset/masks/b"));
    fs::remove_all(project + "/masks");
    write_mask(project + "/mask.png");
    said("4 of 4 photos have masks: ");
    expect_half(folder_ / "dataset/masks/b/1.png.png");
    fs::remove(project + "/mask.png");
    write_mask(project + "/masks/7.png");
    write_mask(project + "/masks/8.png");
    said("2 masks are not used (masks/7.png matches no photo)");
    EXPECT_FALSE(fs::exists(folder_ / "dataset/masks"));
    fs::remove_all(project + "/masks");
    fs::create_directories(project + "/masks/a");
    save_image(project + "/masks/a/0.png", ewa::Image(32, 48, 1));
    fs::remove_all(folder_ / "dataset");
    expect_failure(find("project"), 2, "a/0.png: the mask is 32 x 48 pixels, its image 48 x 32");
}

/// Depth maps are no masks, and a folder of photos may have any name.
TEST_F(PhotoFolders, OfAnyNameHaveNoMasksByIt) {
    fs::create_directories(folder_ / "rides");
    fs::rename(folder_ / "photos", folder_ / "rides/segment_01");
    for (const char* name : {"0", "1", "2", "3"})
        write_mask(folder_ / "rides/segment_01/depth/" + name + ".png");
    fs::remove_all(folder_ / "models");
    make_model("0", {"segment_01/0.png", "segment_01/1.png", "segment_01/2.png", "segment_01/3.png"});
    const Outcome outcome = find("rides");
    ASSERT_EQ(outcome.status, 0) << outcome.err;
    EXPECT_EQ(outcome.out.find(" masks"), std::string::npos) << outcome.out;
    EXPECT_FALSE(fs::exists(folder_ / "dataset/masks"));
}

/// heif-convert's stand-in gives PNG photos as JPEG; a real one is not needed.
TEST_F(PhotoFolders, InHeicAreConverted) {
    const std::string jpegs = folder_ / "jpegs";
    fs::create_directories(jpegs);
    for (const char* name : {"0", "1", "2"}) {
        save_image(jpegs + "/" + name + ".jpg", ewa::load_image(folder_ / "photos/" + name + ".png"));
        fs::rename(folder_ / "photos/" + name + ".png", folder_ / "photos/" + name + ".HEIC");
    }
    fs::rename(folder_ / "photos/2.HEIC", folder_ / "photos/2.avif");
    write_file(folder_ / "photos/damaged.heic", "no photo");
    write_file(folder_ / "photos/3.heic", "a copy of 3.png");
    fs::remove_all(folder_ / "models");
    make_model("0", {"0.jpg", "1.jpg", "2.jpg", "3.png"});
    // Without ewa's modules, too.
    fs::copy_file(EWA_PROGRAM, folder_ / "bin/ewa");
    const Circumstances nothing{.program = folder_ / "bin/ewa",
                                .environment = {{"PATH", folder_ / "bin"}, {"CALLS", folder_ / "calls"}}};
    expect_failure(
        run_ewa({"cameras", folder_ / "photos", "-o", folder_ / "dataset"}, nothing), 2,
        "4 photos are HEIC or AVIF, and no program here reads them (apt install libheif-examples)");
    make_program(folder_ / "bin/heif-dec", R"sh(
[ "$1 $2" = "-q 95" ] || exit 2
for jpeg in "$JPEGS"/*.jpg; do
    if cmp -s "$3" "$PNGS/$(basename "$jpeg" .jpg).png"; then cp "$jpeg" "$4"; exit 0; fi
done
echo "no HEIF" >&2; exit 1
)sh");
    const Outcome outcome = run({"cameras", folder_ / "photos", "-o", folder_ / "dataset"},
                                {.environment = {{"JPEGS", jpegs}, {"PNGS", folder_ / "source/images"}}});
    ASSERT_EQ(outcome.status, 0) << outcome.err;
    EXPECT_NE(outcome.out.find("1 photo cannot be used: damaged.heic (it cannot be converted)"),
              std::string::npos)
        << outcome.out;
    EXPECT_NE(outcome.out.find("4 of 4 photos have cameras"), std::string::npos) << outcome.out;
    expect_searched("0.jpg\n1.jpg\n2.jpg\n3.png\n");
    expect_success(run({"train", folder_ / "dataset", "-o", folder_ / "run", "--steps", "1", "--quiet"}));
    // The photos are the same as before.
    EXPECT_EQ(run({"cameras", folder_ / "photos", "-o", folder_ / "dataset"}).status, 0);
    EXPECT_EQ(calls(), "feature_extractor\nmatches_importer\nmapper\n");
}

TEST_F(PhotoFolders, OfRunsAndDatasetsAreRefused) {
    expect_success(run({"train", folder_ / "photos", "-o", folder_ / "run", "--steps", "2", "--quiet"}));
    ASSERT_TRUE(fs::exists(folder_ / "run/test"));
    const auto refused = [&](const std::string& command, const std::string& input, const std::string& text) {
        expect_failure(run({command, folder_ / input, "-o", folder_ / "x"}), 2, text);
        EXPECT_FALSE(fs::exists(folder_ / "x"));
    };
    refused("cameras", "run", folder_ / "run is a run: its cameras are in ");
    refused("cameras", "run/", "run/dataset");
    refused("cameras", "run/test", "has pictures that a run has made: its cameras are in ");
    refused("train", "run/test", "has pictures that a run has made: its cameras are in ");
    refused("cameras", "run/dataset", "is a dataset: its images have cameras");
    fs::create_directories(folder_ / "begun/unpacked");
    write_file(folder_ / "begun/capture.json", "{}");
    fs::copy(folder_ / "photos/0.png", folder_ / "begun/0.png");
    refused("cameras", "begun", "is a dataset that is not finished");
    expect_success(run({"train", folder_ / "source", "-o", folder_ / "other", "--steps", "2", "--quiet"}));
    refused("cameras", "other", "is a run: its config.json names the dataset");
}

TEST_F(PhotoFolders, WithoutPhotosGiveTheFramesOfTheirVideos) {
    make_program(folder_ / "bin/ffmpeg", R"sh(
case "$*" in
*image2pipe*)
    for i in 0 1 2 3 4 5; do printf 'P5\n4 3\n255\naaaabbbbcccc'; done;;
*frame_*)
    for word; do last=${word#file:}; done
    for i in 0 1 2; do cp "$PHOTOS/$i.png" "$(dirname "$last")/frame_0000$((i + 1)).jpg"; done;;
esac
)sh");
    fs::create_directories(folder_ / "films/day");
    write_file(folder_ / "films/a.mp4", "a film");
    write_file(folder_ / "films/day/b.wmv", "another film");
    write_file(folder_ / "films/._a.mp4", "Mac OS X");
    fs::remove_all(folder_ / "models");
    make_model("0", {"a/frame_00001.jpg", "a/frame_00002.jpg", "b/frame_00001.jpg"});
    const Circumstances photos{.environment = {{"PHOTOS", folder_ / "photos"}}};
    const std::vector<std::string> command{"cameras",           folder_ / "films", "-o",
                                           folder_ / "dataset", "--frames",        "6"};
    const Outcome outcome = run(command, photos);
    ASSERT_EQ(outcome.status, 0) << outcome.err;
    expect_searched(
        "a/frame_00001.jpg\na/frame_00002.jpg\na/frame_00003.jpg\n"
        "b/frame_00001.jpg\nb/frame_00002.jpg\nb/frame_00003.jpg\n");
    EXPECT_NE(outcome.out.find("3 of 6 photos have cameras"), std::string::npos) << outcome.out;
    EXPECT_LT(std::count(outcome.out.begin(), outcome.out.end(), '\n'), 20) << outcome.out;
    write_file(folder_ / "films/c.mkv", "a third");
    expect_failure(run(command, photos), 2, "the video has changed since");
    // Beside photos they are not used.
    write_file(folder_ / "photos/0.mov", "what moved");
    write_file(folder_ / "photos/walk.mov", "a walk");
    fs::remove_all(folder_ / "dataset");
    const Outcome mixed = find("photos");
    EXPECT_NE(mixed.out.find("1 video is not used beside photos: walk.mov"), std::string::npos) << mixed.out;
}

TEST_F(PhotoFolders, FaultsOfPhotosAreNamedPlainly) {
    write_file(folder_ / "photos/empty.jpg", "");
    const std::string jpeg = folder_ / "photos/cut.jpg";
    save_image(jpeg, ewa::Image(200, 200, 3));
    write_file(jpeg, read_file(jpeg).substr(0, fs::file_size(jpeg) / 2));
    const Outcome outcome = find("photos");
    EXPECT_NE(outcome.out.find(
                  "2 photos cannot be used: cut.jpg (the JPEG is truncated), empty.jpg (the file is empty)"),
              std::string::npos)
        << outcome.out;
}

/// CTest does not wait for the help to end.
TEST_F(PhotoFolders, AHelpThatHangsCanBeStopped) {
    make_program(folder_ / "bin/colmap", "echo > \"$CALLS.asked\"\nexec sleep 1000\n");
    const Outcome outcome = run({"cameras", folder_ / "photos", "-o", folder_ / "dataset"},
                                {.await_file = folder_ / "calls.asked", .signal = SIGTERM});
    EXPECT_EQ(outcome.status, 130) << outcome.err;
}

/// A help without end, and lines without end: bounded in time and memory.
TEST_F(PhotoFolders, ProgramsThatFloodAreEnded) {
    make_program(folder_ / "bin/colmap", R"sh(
case "$*" in *--help*) exec yes aaaaaaaaaaaaaaaaaaaaaaaaaaaaaaa;; esac
head -c 100000000 /dev/zero | tr '\0' x
head -c 30000000 /dev/zero | tr '\0' y >&2
exit 1
)sh");
    expect_failure(
        run({"cameras", folder_ / "photos", "-o", folder_ / "dataset"}, {.address_limit = size_t(1) << 30}),
        1, "colmap feature_extractor failed");
    EXPECT_LT(fs::file_size(folder_ / "dataset/colmap/log.txt"), size_t(20) << 20);
    EXPECT_NE(read_file(folder_ / "dataset/colmap/log.txt").find("[the rest is left out]"),
              std::string::npos);
}

/// What an interrupted search has done does not count for its pace.
TEST_F(PhotoFolders, AContinuedSearchHasItsOwnPace) {
    std::vector<DatabaseImage> images;
    for (const std::string name : {"0.png", "1.png"})
        images.push_back({name, std::vector<std::uint8_t>(128, 1), {1.0f}});
    write_colmap_database(folder_ / "features.db", images);
    make_program(folder_ / "bin/colmap", R"sh(
case "$*" in *--help*) exit 0;; esac
if [ "$1" = feature_extractor ]; then
    if [ "$FIRST" ]; then cp "$DATABASE" "$3"; exit 1; fi
    echo "Processed file [1/4]"; echo "Processed file [2/4]"; sleep 0.6
    echo "Processed file [3/4]"; sleep 0.6; echo "Processed file [4/4]"; sleep 0.6
    exit 0
fi
exit 1
)sh");
    const auto search = [&](const char* first) {
        return run({"cameras", folder_ / "photos", "-o", folder_ / "dataset"},
                   {.environment = {{"DATABASE", folder_ / "features.db"}, {"FIRST", first}}});
    };
    expect_failure(search("yes"), 1, "colmap feature_extractor failed");
    const Outcome outcome = search("");
    const size_t line = outcome.out.find("searched 3/4 photos, ");
    ASSERT_NE(line, std::string::npos) << outcome.out;
    const double rate = std::stod(outcome.out.substr(line + std::string("searched 3/4 photos, ").size()));
    EXPECT_LT(rate, 2.5) << outcome.out;
    EXPECT_EQ(outcome.out.find("searched 1/4"), std::string::npos) << outcome.out;
}

/// On a processor, the usual steps take hours: that is said before the search, and no time before it is measured.
TEST_F(PhotoFolders, AreToldOfAShorterTrainingFirst) {
    make_program(folder_ / "bin/colmap", R"sh(
case "$*" in *--help*) exit 0;; esac
[ "$1" = feature_extractor ] || exit 1
sleep 0.3; touch "$3"; for i in 1 2 3 4; do echo "Processed file [$i/4]"; sleep 0.1; done
)sh");
    const Outcome usual = run({"train", folder_ / "photos", "-o", folder_ / "run"});
    const size_t advice = usual.out.find("30000 steps take about ");
    ASSERT_NE(advice, std::string::npos) << usual.out;
    EXPECT_NE(usual.out.find("; --quality low takes about ", advice), std::string::npos) << usual.out;
    EXPECT_LT(advice, usual.out.find("searched")) << usual.out;
    const size_t left = usual.out.find(" left");
    ASSERT_NE(left, std::string::npos) << usual.out;
    EXPECT_GT(left, usual.out.find("searched 1/4")) << usual.out;
    const Outcome low = run({"train", folder_ / "photos", "-o", folder_ / "low", "--quality", "low"});
    EXPECT_EQ(low.out.find("--quality low"), std::string::npos) << low.out;
}

}  // namespace
