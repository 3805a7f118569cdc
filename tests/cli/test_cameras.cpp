// SPDX-License-Identifier: Apache-2.0
// ewa cameras, and ewa train of photos, with programs in the place of COLMAP and ffmpeg. The last test runs the real ones.
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <cstdlib>
#include <filesystem>

#include "capture/feature_database.h"
#include "cli/cameras_test.h"
#include "core/packages.h"
#include "core/process.h"
#include "ewa/image.h"
#include "io/splats/archive.h"
#include "support/colmap_database.h"

namespace {

using namespace ewa::test;
namespace fs = std::filesystem;

using Cameras = CamerasTest;

TEST_F(Cameras, OfPhotosBecomeADataset) {
    make_model("0", {"0.png", "1.png", "2.png", "3.png"});
    const Outcome outcome = cameras();
    ASSERT_EQ(outcome.status, 0) << outcome.err;
    EXPECT_NE(outcome.out.find("4 of 4 photos have cameras"), std::string::npos) << outcome.out;
    EXPECT_EQ(outcome.out.find("could not be placed"), std::string::npos) << outcome.out;
    EXPECT_EQ(calls(), "feature_extractor\nmatches_importer\nmapper\n");
    EXPECT_EQ(run_ewa({"info", folder_ / "dataset"}).status, 0);
    EXPECT_NE(read_file(folder_ / "dataset/colmap/log.txt").find("Processed file [4/4]"), std::string::npos);

    // A second run has nothing to do.
    EXPECT_EQ(cameras().status, 0);
    EXPECT_EQ(calls(), "feature_extractor\nmatches_importer\nmapper\n");
}

TEST_F(Cameras, OfTheLargestModelAreTaken) {
    make_model("0", {"2.png"});
    make_model("1", {"0.png", "1.png", "3.png"});
    const Outcome outcome = cameras();
    ASSERT_EQ(outcome.status, 0) << outcome.err;
    EXPECT_NE(outcome.out.find("2 separate models of 3 and 1 photos"), std::string::npos) << outcome.out;
    EXPECT_NE(outcome.out.find("1 of 4 photos could not be placed, and are not used: 2.png"),
              std::string::npos)
        << outcome.out;
}

/// Photos that nothing connects: neighbours by name are compared, and the others where these do not suffice.
TEST_F(Cameras, ComeFromComparingWhatLooksAlike) {
    std::vector<DatabaseImage> images;
    for (int i = 0; i < 4; ++i) {
        images.push_back({std::to_string(i) + ".png", std::vector<std::uint8_t>(128, 0), {1.0f}});
        images.back().descriptors[size_t(i)] = 255;
    }
    write_colmap_database(folder_ / "features.db", images);
    const Circumstances features{.environment = {{"DATABASE", folder_ / "features.db"}}};
    const auto first_and_last = [&] {
        return ewa::capture::FeatureDatabase(folder_ / "dataset/colmap/database.db").is_compared(1, 4);
    };
    make_model("0", {"0.png", "1.png", "2.png", "3.png"});
    const Outcome outcome = cameras(features);
    ASSERT_EQ(outcome.status, 0) << outcome.err;
    EXPECT_NE(outcome.out.find("matched 5/5 pairs"), std::string::npos) << outcome.out;
    EXPECT_EQ(calls(), "feature_extractor\nmatches_importer\nmapper\n");
    EXPECT_FALSE(first_and_last());

    fs::remove_all(folder_ / "dataset");
    fs::remove(folder_ / "calls");
    make_model("0", {"0.png", "1.png", "2.png"});
    ASSERT_EQ(cameras(features).status, 0);
    // Three of four are so few that all are compared, then another way is tried. At last the fourth may come with fewer matches.
    EXPECT_EQ(calls(),
              "feature_extractor\nmatches_importer\nmapper\nmatches_importer\nmapper\nmapper\nmapper\n");
    EXPECT_TRUE(first_and_last());

    // A search that failed at the end continues there.
    fs::remove_all(folder_ / "dataset/sparse");
    fs::remove(folder_ / "calls");
    ASSERT_EQ(cameras(features).status, 0);
    EXPECT_EQ(calls(), "mapper\nmapper\nmapper\n");
}

/// A mapper that places more photos where the first pair may be apart by forward motion.
TEST_F(Cameras, ComeFromTheWayThatPlacesMost) {
    make_model("few/0", {"0.png", "1.png"});
    make_model("most/0", {"0.png", "1.png", "2.png", "3.png"});
    make_program(folder_ / "bin/colmap", R"sh(
case "$*" in *--help*) exit 0;; esac
echo "$1" >> "$CALLS"
case "$*" in *init_max_forward_motion*) models=most;; *) models=few;; esac
case $1 in
feature_extractor) touch "$3";;
mapper) for word; do if [ "$previous" = --output_path ]; then cp -r "$MODELS/$models/." "$word"; fi; previous=$word; done;;
esac
)sh");
    const Outcome outcome = cameras();
    ASSERT_EQ(outcome.status, 0) << outcome.err;
    EXPECT_NE(outcome.out.find("placed 2 of 4 photos in "), std::string::npos) << outcome.out;
    EXPECT_NE(outcome.out.find("placed 4 of 4 photos with forward motion in "), std::string::npos)
        << outcome.out;
    EXPECT_NE(outcome.out.find("4 of 4 photos have cameras"), std::string::npos) << outcome.out;
    EXPECT_EQ(calls(), "feature_extractor\nmatches_importer\nmapper\nmatches_importer\nmapper\nmapper\n");
}

/// A mapper that adds a photo to its model where that may have fewer matches.
TEST_F(Cameras, OfPhotosWithFewMatchesComeLast) {
    make_model("few/0", {"0.png", "1.png", "2.png"});
    make_model("more/0", {"0.png", "1.png", "2.png", "3.png"});
    make_program(folder_ / "bin/colmap", R"sh(
case "$*" in *--help*) exit 0;; esac
case "$*" in *--input_path*abs_pose_min_num_inliers*) models=more/0;; *) models=few;; esac
case $1 in
feature_extractor) touch "$3";;
mapper) for word; do if [ "$previous" = --output_path ]; then cp -r "$MODELS/$models/." "$word"; fi; previous=$word; done;;
esac
)sh");
    const Outcome outcome = cameras();
    ASSERT_EQ(outcome.status, 0) << outcome.err;
    EXPECT_NE(outcome.out.find("placed 4 of 4 photos with fewer matches in "), std::string::npos)
        << outcome.out;
    EXPECT_NE(outcome.out.find("4 of 4 photos have cameras"), std::string::npos) << outcome.out;
}

/// A model of a lens that no camera has is said to be wrong.
TEST_F(Cameras, ThatCannotBeRightAreNamed) {
    std::vector<DatabaseImage> images;
    for (int i = 0; i < 4; ++i) {
        images.push_back({std::to_string(i) + ".png", std::vector<std::uint8_t>(128, 0), {1.0f}});
        images.back().descriptors[size_t(i)] = 255;
    }
    write_colmap_database(folder_ / "features.db", images);
    lens_ = {40.0, 44.0, 24.0, 16.0};
    make_model("0", {"0.png", "1.png", "2.png", "3.png"});
    const Outcome outcome = cameras({.environment = {{"DATABASE", folder_ / "features.db"}}});
    ASSERT_EQ(outcome.status, 0) << outcome.err;
    EXPECT_NE(
        outcome.out.find("the cameras of 4 photos are probably wrong, since the focal lengths are 40 px "
                         "along and 44 px across: 0.png, 1.png, 2.png, 3.png"),
        std::string::npos)
        << outcome.out;
}

/// COLMAP's lists end a name at a space.
TEST_F(Cameras, OfNamesWithSpacesAreVerifiedWithoutAList) {
    fs::rename(folder_ / "photos/1.png", folder_ / "photos/a b.png");
    make_model("0", {"0.png", "2.png", "3.png", "a b.png"});
    ASSERT_EQ(cameras().status, 0);
    EXPECT_EQ(calls(), "feature_extractor\nexhaustive_matcher\nmapper\n");
}

TEST_F(Cameras, ThatCannotBeFoundAreExplained) {
    fs::create_directories(folder_ / "models");
    expect_failure(cameras(), 2, "COLMAP could not place the 4 photos: too few of their details match");
    expect_failure(cameras({.environment = {{"FAIL", "mapper"}}}), 2, "COLMAP could not place the 4 photos");
    EXPECT_FALSE(fs::exists(folder_ / "dataset/sparse/0"));
}

TEST_F(Cameras, AFailureNamesTheLogAndCanBeRepeated) {
    make_model("0", {"0.png", "1.png", "2.png", "3.png"});
    expect_failure(
        cameras({.environment = {{"FAIL", "matches_importer"}}}), 1,
        "colmap matches_importer failed; " + folder_ / "dataset/colmap/log.txt" + " has its reason");
    EXPECT_NE(read_file(folder_ / "dataset/colmap/log.txt").find("the reason"), std::string::npos);
    EXPECT_EQ(cameras().status, 0);
    // What was done is kept.
    EXPECT_EQ(calls(), "feature_extractor\nmatches_importer\nmatches_importer\nmapper\n");
}

TEST_F(Cameras, CtrlCEndsColmapToo) {
    make_model("0", {"0.png", "1.png", "2.png", "3.png"});
    const Outcome outcome = cameras({.await_file = folder_ / "calls.hangs",
                                     .signal = SIGINT,
                                     .environment = {{"HANG", "matches_importer"}}});
    EXPECT_EQ(outcome.status, 130) << outcome.err;
    EXPECT_NE(outcome.out.find("interrupted; to continue, repeat the command"), std::string::npos)
        << outcome.out;
    EXPECT_EQ(cameras().status, 0);
}

TEST_F(Cameras, AnotherInputNeedsAnotherFolder) {
    make_model("0", {"0.png", "1.png", "2.png", "3.png"});
    ASSERT_EQ(cameras().status, 0);
    fs::copy(folder_ / "photos", folder_ / "others");
    expect_failure(run({"cameras", folder_ / "others", "-o", folder_ / "dataset"}), 2,
                   "is the dataset of another input");
    fs::create_directories(folder_ / "full");
    write_file(folder_ / "full/notes.txt", "mine");
    expect_failure(run({"cameras", folder_ / "photos", "-o", folder_ / "full"}), 2, "is not empty");
    EXPECT_EQ(files_below(folder_ / "full"), std::vector<std::string>{"notes.txt"});
}

/// The camera of a photo that was changed afterwards would be that of another picture.
TEST_F(Cameras, ThatWereFoundOutlastChangesOfThePhotos) {
    make_model("0", {"0.png", "1.png", "2.png", "3.png"});
    ASSERT_EQ(cameras().status, 0);
    const auto told = [&](const std::string& text) {
        const Outcome outcome = cameras();
        EXPECT_EQ(outcome.status, 0) << outcome.err;
        EXPECT_NE(outcome.out.find(text), std::string::npos) << outcome.out;
    };
    fs::copy(folder_ / "photos/0.png", folder_ / "photos/more.png");
    told("1 photo is new, and is not used; another -o DIR searches its camera, too: more.png\n");
    fs::remove(folder_ / "photos/more.png");
    fs::rename(folder_ / "photos/0.png", folder_ / "0.png");
    told("1 photo is missing, and its view is not used: 0.png\n");
    told("dataset: 3 of 3 photos have cameras");
    const Outcome trained = run({"train", folder_ / "dataset", "-o", folder_ / "run", "--steps", "1"});
    EXPECT_EQ(trained.status, 0) << trained.err;
    EXPECT_NE(trained.out.find("1 image is missing and skipped"), std::string::npos) << trained.out;
    fs::copy(folder_ / "photos/1.png", folder_ / "photos/0.png");
    told("1 photo has changed since the search for its camera, and its view is not used: 0.png\n");
    EXPECT_EQ(calls(), "feature_extractor\nmatches_importer\nmapper\n");
    EXPECT_EQ(run_ewa({"info", folder_ / "dataset"}).out.find("frames          4"), std::string::npos);
    EXPECT_NE(run_ewa({"info", folder_ / "dataset"}).out.find("frames          3"), std::string::npos);

    // A record from before the contents were recorded.
    auto record = read_json(folder_ / "dataset/capture.json");
    EXPECT_EQ(record.erase("files"), 1u);
    write_file(folder_ / "dataset/capture.json", record.dump());
    EXPECT_EQ(cameras().status, 0);
}

TEST_F(Cameras, DamagedPhotosAreSkippedByName) {
    make_model("0", {"0.png", "1.png", "2.png", "3.png"});
    const std::string whole = read_file(folder_ / "photos/0.png");
    write_file(folder_ / "photos/cut.png", whole.substr(0, whole.size() - 20));
    write_file(folder_ / "photos/empty.jpg", "");
    write_file(folder_ / "photos/notes.jpg", "not a picture");
    for (int turn = 0; turn < 2; ++turn) {
        const Outcome outcome = cameras();
        ASSERT_EQ(outcome.status, 0) << outcome.err;
        EXPECT_NE(outcome.out.find("3 photos cannot be used: cut.png ("), std::string::npos) << outcome.out;
        EXPECT_NE(outcome.out.find("), empty.jpg ("), std::string::npos) << outcome.out;
        EXPECT_NE(outcome.out.find("4 of 4 photos have cameras"), std::string::npos) << outcome.out;
    }
    EXPECT_EQ(read_file(folder_ / "dataset/colmap/photos.txt"), "0.png\n1.png\n2.png\n3.png\n");
    for (const char* name : {"/0.png", "/1.png"}) write_file(folder_ / "photos" + name, "");
    expect_failure(run({"cameras", folder_ / "photos", "-o", folder_ / "other"}), 2,
                   "has 2 photos (JPEG, PNG, TIFF or BMP); cameras need at least 3");
}

/// Damage that comes after the search.
TEST_F(Cameras, APhotoThatTrainingCannotReadLosesItsView) {
    make_model("0", {"0.png", "1.png", "2.png", "3.png"});
    ASSERT_EQ(cameras().status, 0);
    const std::string whole = read_file(folder_ / "photos/2.png");
    for (const std::string& bytes : {whole.substr(0, whole.size() - 20), std::string()}) {
        write_file(folder_ / "photos/2.png", bytes);
        const Outcome outcome =
            run({"train", folder_ / "dataset", "-o", folder_ / "run", "--steps", "1", "--force"});
        EXPECT_EQ(outcome.status, 0) << outcome.err;
        EXPECT_NE(outcome.out.find("skipped, since it cannot be read: 2.png ("), std::string::npos)
            << outcome.out;
    }
}

TEST_F(Cameras, LinksToPhotosAreRefusedAtOnce) {
    fs::create_directories(folder_ / "links");
    for (const char* name : {"/0.png", "/1.png", "/2.png"})
        fs::create_symlink(std::string("../photos") + name, folder_ / "links" + name);
    expect_failure(run({"cameras", folder_ / "links", "-o", folder_ / "dataset"}), 2,
                   folder_ / "links/0.png" + " is a link out of its folder; copy the photos with cp -rL");
    EXPECT_FALSE(fs::exists(folder_ / "dataset"));
    // A link to the whole folder is none out of it.
    fs::create_directory_symlink("photos", folder_ / "linked");
    make_model("0", {"0.png", "1.png", "2.png", "3.png"});
    expect_success(run({"cameras", folder_ / "linked", "-o", folder_ / "dataset"}));
    expect_success(run({"train", folder_ / "dataset", "-o", folder_ / "run", "--steps", "1"}));
}

TEST_F(Cameras, NamesThatNoLineHoldsAreSkippedAndOthersKept) {
    make_model("0", {"0.png", "1.png", "2.png", "3.png", "\xff.png"});
    fs::create_directories(folder_ / "photos/a\n..");
    fs::copy(folder_ / "photos/0.png", folder_ / "photos/a\n../secret.png");
    fs::copy(folder_ / "photos/0.png", folder_ / "photos/\xff.png");
    for (int turn = 0; turn < 2; ++turn) {
        const Outcome outcome = cameras();
        ASSERT_EQ(outcome.status, 0) << outcome.err;
        EXPECT_NE(outcome.out.find("1 photo cannot be used: a ../secret.png (its name has a line break"),
                  std::string::npos)
            << outcome.out;
        EXPECT_NE(outcome.out.find("5 of 5 photos have cameras"), std::string::npos) << outcome.out;
    }
    EXPECT_EQ(read_file(folder_ / "dataset/colmap/photos.txt"), "0.png\n1.png\n2.png\n3.png\n\xff.png\n");
}

/// COLMAP describes photos of a run alike, so each lens has its run.
TEST_F(Cameras, PhotosOfOneLensShareACamera) {
    make_program(folder_ / "bin/colmap", R"sh(
case "$*" in *--help*) echo "  --SiftExtraction.use_gpu arg (=1)"; exit 0;; esac
if [ "$1" = feature_extractor ]; then
    case "$*" in *"first_octave 0"*) large=" large";; esac
    echo "${11} ${9}$large: $(tr '\n' ' ' < "$7")" >> "$CALLS"
    touch "$3"
else
    exit 1
fi
)sh");
    fs::remove_all(folder_ / "photos");
    fs::create_directories(folder_ / "photos/wide");
    fs::create_directories(folder_ / "photos/tall");
    for (const char* name : {"/0.png", "/1.png"}) {
        save_image(folder_ / "photos/wide" + name, ewa::Image(64, 32, 3));
        save_image(folder_ / "photos/tall" + name, ewa::Image(32, 64, 3));
    }
    save_image(folder_ / "photos/z.png", ewa::Image(2000, 1500, 3));
    EXPECT_NE(cameras().status, 0);
    EXPECT_EQ(calls(),
              "SIMPLE_RADIAL 1: tall/0.png tall/1.png \n"
              "SIMPLE_RADIAL 1: wide/0.png wide/1.png \n"
              "SIMPLE_RADIAL 0 large: z.png \n");
}

/// What needs no cameras is known before they are searched.
TEST_F(Cameras, OptionsAreCheckedBeforeTheSearch) {
    make_model("0", {"0.png", "1.png", "2.png", "3.png"});
    write_file(folder_ / "film.mp4", "no film");
    write_file(folder_ / "damaged.ply", "ply\n");
    const auto refused = [&](const std::vector<std::string>& options, const std::string& text,
                             const std::string& input = "photos") {
        std::vector<std::string> command{"train", folder_ / input, "-o", folder_ / "run"};
        command.insert(command.end(), options.begin(), options.end());
        const Outcome outcome = run(command);
        expect_failure(outcome, outcome.status == 1 ? 1 : 2, text);
        EXPECT_FALSE(fs::exists(folder_ / "run")) << text;
    };
    refused({"--device", "nosuchdevice"}, "nosuchdevice");
    refused({"--serve", "99999"}, "--serve: '99999' is not a port");
    refused({"--init", "nothere.ply"}, "nothere.ply");
    refused({"--init", folder_ / "damaged.ply"}, "damaged.ply");
    refused({"--downscale", "1000"}, "--downscale 1000 leaves 1x1 pixels of the smallest image");
    refused({"--test-every", "1"}, "--test-every 1 holds every image out");
    refused({"--frames", "5"}, "--frames 5: " + folder_ / "photos" + " has photos, of which all are used");
    refused({"--frames", "2"}, "--frames: '2' is not a number of frames", "film.mp4");
    refused({"--init", "random", "--dense-start", "on"}, "--dense-start on");
    refused({"--absgrad", "--strategy", "mcmc"}, "--absgrad");
    refused({"--config", "nothere.json"}, "nothere.json");
    expect_failure(run({"cameras", folder_ / "photos", "-o", folder_ / "run", "--frames", "5"}), 2,
                   "--frames 5: " + folder_ / "photos" + " has photos, of which all are used");
    EXPECT_EQ(calls(), "");
}

TEST_F(Cameras, OfADatasetAreNotSearchedAgain) {
    make_model("0", {"0.png", "1.png", "2.png", "3.png"});
    expect_failure(run({"train", folder_ / "source/images", "-o", folder_ / "run"}), 2,
                   "has the cameras of " + folder_ / "source/images" + ": ewa train ");
    expect_failure(run({"cameras", folder_ / "source", "-o", folder_ / "dataset"}), 2,
                   folder_ / "source" + " is a dataset: its images have cameras; ewa train");
    EXPECT_EQ(calls(), "");
    expect_success(run({"cameras", folder_ / "source/images", "-o", folder_ / "dataset"}));
}

/// A run in a folder of photos, and then another one.
TEST_F(Cameras, RendersOfRunsAreNoPhotos) {
    make_model("0", {"0.png", "1.png", "2.png", "3.png"});
    for (const char* name : {"first", "second"}) {
        expect_success(run({"train", folder_ / "photos", "-o", folder_ / "photos/out" + "/" + name, "--steps",
                            "2", "--quiet"}));
        const auto record = read_json(folder_ / "photos/out" + "/" + name + "/dataset/capture.json");
        EXPECT_EQ(record.at("files").size(), 4u) << record;
    }
}

/// A killed ewa cannot end COLMAP, whose work the next run would disturb.
TEST_F(Cameras, ColmapEndsWithAKilledEwa) {
    make_model("0", {"0.png", "1.png", "2.png", "3.png"});
    const Outcome outcome = cameras({.await_file = folder_ / "calls.hangs",
                                     .signal = SIGKILL,
                                     .environment = {{"HANG", "matches_importer"}}});
    EXPECT_EQ(outcome.status, 128 + SIGKILL);
    const std::string process =
        "/proc/" + std::to_string(std::stoi(read_file(folder_ / "calls.hangs"))) + "/stat";
    const auto lives = [&] {  // nobody may reap it
        const std::string state = fs::exists(process) ? read_file(process) : "";
        return !state.empty() && state.find(") Z") == std::string::npos;
    };
    for (int i = 0; i < 1000 && lives(); ++i) usleep(10000);
    EXPECT_FALSE(lives());
    EXPECT_EQ(cameras().status, 0);
}

/// The time left is that of the search, the comparison, the placing and the training together.
TEST_F(Cameras, LeaveTimeForTheTrainingAfterThem) {
    make_program(folder_ / "bin/colmap", R"sh(
case "$*" in *--help*) exit 0;; esac
if [ "$1" = feature_extractor ]; then
    touch "$3"
    for i in 1 2 3 4; do sleep 0.05; echo "Processed file [$i/4]"; done
    exit 0
fi
exit 1
)sh");
    const Outcome alone = cameras();
    EXPECT_NE(alone.out.find("searched 3/4 photos, "), std::string::npos) << alone.out;
    EXPECT_EQ(alone.out.find(" h "), std::string::npos) << alone.out;
    const Outcome with_training = run({"train", folder_ / "photos", "-o", folder_ / "out", "--steps", "20M"});
    expect_failure(with_training, 1, "colmap matches_importer failed");
    const size_t line = with_training.out.find("searched 3/4 photos, ");
    ASSERT_NE(line, std::string::npos) << with_training.out;
    const std::string text = with_training.out.substr(line, with_training.out.find('\n', line) - line);
    EXPECT_NE(text.find(" h "), std::string::npos) << text;
    EXPECT_TRUE(text.ends_with(" left")) << text;
}

TEST_F(Cameras, PhotosMayChangeWhileTheyGiveNothing) {
    make_model("0", {"0.png", "1.png", "2.png"});
    make_program(folder_ / "bin/colmap", "exit 1");
    EXPECT_EQ(cameras().status, 1);
    fs::remove(folder_ / "photos/3.png");
    SetUpColmap();
    EXPECT_EQ(cameras().status, 0);
    EXPECT_EQ(read_json(folder_ / "dataset/capture.json").at("files").size(), 3u);
}

TEST_F(Cameras, DamagedVideosAreUnreadableInput) {
    make_program(folder_ / "bin/ffmpeg", "echo no moov >&2; exit 1");
    write_file(folder_ / "film.mp4", "no film");
    const std::string log = folder_ / "dataset/colmap/log.txt";
    expect_failure(run({"cameras", folder_ / "film.mp4", "-o", folder_ / "dataset"}), 2,
                   folder_ / "film.mp4: ffmpeg cannot read the video; " + log + " has its reason");
    EXPECT_NE(read_file(log).find("no moov"), std::string::npos);
    // Another try with a better film is no other input.
    write_file(folder_ / "film.mp4", "another film");
    expect_failure(run({"cameras", folder_ / "film.mp4", "-o", folder_ / "dataset"}), 2,
                   "ffmpeg cannot read the video");
}

TEST_F(Cameras, WhatIsNoPhotosIsNamed) {
    fs::create_directories(folder_ / "empty");
    write_file(folder_ / "g.spz", "NGSP and so on");
    write_file(folder_ / "notes", "text");
    const std::string no_splats = folder_ / "g.spz is a splat file (SPZ), not a folder of photos";
    const std::string picture = folder_ / "photos/0.png is a single picture; name the folder of the photos";
    const auto refused = [&](const std::string& command, const std::string& input, const std::string& text) {
        expect_failure(run({command, folder_ / input, "-o", folder_ / "x"}), 2, text);
        EXPECT_FALSE(fs::exists(folder_ / "x"));
    };
    for (const char* command : {"train", "cameras"}) {
        refused(command, "g.spz", no_splats);
        refused(command, "photos/0.png", picture);
        refused(command, "nowhere", "there is no such file or folder");
    }
    refused("train", "empty", "neither photos, nor a video, nor a dataset; a dataset has cameras and images");
    refused("train", "notes", "neither a video nor a dataset; a dataset is a folder");
    refused("cameras", "notes", "neither a video nor a folder with photos");
}

TEST_F(Cameras, WhatIsMissingIsNamed) {
    fs::remove(folder_ / "bin/colmap");
    const Circumstances bare{.environment = {{"PATH", folder_ / "bin"}, {"VIRTUAL_ENV", ""}}};
    expect_failure(run_ewa({"cameras", folder_ / "photos", "-o", folder_ / "dataset"}, bare), 1,
                   ewa::core::how_to_install(ewa::core::Thing::colmap));
    write_file(folder_ / "film.mp4", "no film");
    expect_failure(run_ewa({"cameras", folder_ / "film.mp4", "-o", folder_ / "film"}, bare), 1,
                   "apt install ffmpeg");
    make_program(folder_ / "bin/ffmpeg", "exit 1");
    expect_failure(run_ewa({"cameras", folder_ / "film.mp4", "-o", folder_ / "film"}, bare), 1,
                   ewa::core::how_to_install(ewa::core::Thing::colmap));
    // Nothing is left of the attempts.
    for (const char* made : {"dataset", "film"}) EXPECT_FALSE(fs::exists(folder_ / made)) << made;
    expect_failure(run_ewa({"cameras", folder_ / "nowhere", "-o", folder_ / "x"}), 2,
                   "there is no such file or folder");
    expect_failure(run_ewa({"cameras", folder_ / "bin", "-o", folder_ / "x"}), 2,
                   "neither a video nor a folder with photos");
    EXPECT_FALSE(fs::exists(folder_ / "x"));
}

/// The stand-in of ffmpeg has 9 frames, of which every third is sharp.
TEST_F(Cameras, OfAVideoAreThoseOfItsSharpestFrames) {
    make_program(folder_ / "bin/ffmpeg", R"sh(
echo "$@" >> "$CALLS.ffmpeg"
case "$*" in
*image2pipe*)
    for i in 0 1 2 3 4 5 6 7 8; do
        printf 'P5\n4 3\n255\n'
        if [ $((i % 3)) = 1 ]; then printf 'a\377a\377\377a\377aa\377a\377'; else printf 'aaaabbbbcccc'; fi
    done;;
*)
    for word; do last=${word#file:}; done
    for i in 0 1 2; do cp "$PHOTOS/$i.png" "$(dirname "$last")/frame_0000$((i + 1)).jpg"; done;;
esac
)sh");
    make_model("0", {"frame_00001.jpg", "frame_00002.jpg", "frame_00003.jpg"});
    write_file(folder_ / "film.mp4", "a film");
    const Outcome outcome = run({"cameras", folder_ / "film.mp4", "-o", folder_ / "dataset", "--frames", "3"},
                                {.environment = {{"PHOTOS", folder_ / "photos"}}});
    ASSERT_EQ(outcome.status, 0) << outcome.err;
    EXPECT_NE(outcome.out.find("3 of 3 photos have cameras"), std::string::npos) << outcome.out;
    EXPECT_NE(read_file(folder_ / "calls.ffmpeg").find("select='eq(n,1)+eq(n,4)+eq(n,7)'"),
              std::string::npos);
    EXPECT_EQ(calls(), "feature_extractor\nmatches_importer\nmapper\n");

    EXPECT_NE(read_file(folder_ / "calls.ffmpeg").find("-format_whitelist"), std::string::npos);

    // ewa train takes as many frames.
    fs::remove(folder_ / "calls.ffmpeg");
    std::vector<std::string> train{"train",  folder_ / "film.mp4", "-o", folder_ / "run", "--steps", "2",
                                   "--quiet"};
    const auto train_with = [&](const std::string& frames) {
        std::vector<std::string> all = train;
        all.insert(all.end(), {"--frames", frames});
        return run(all, {.environment = {{"PHOTOS", folder_ / "photos"}}});
    };
    expect_failure(train_with("0-2"), 2, "'0-2' is not a number of frames to take from a video, 3 to 100000");
    expect_success(train_with("3"));
    EXPECT_NE(read_file(folder_ / "calls.ffmpeg").find("select='eq(n,1)+eq(n,4)+eq(n,7)'"),
              std::string::npos);
}

/// A zip archive of the files below a folder.
void zip_folder(const std::string& folder, const std::string& path, const std::string& above = "") {
    ewa::io::ArchiveWriter writer;
    for (const std::string& name : files_below(folder))
        writer.add(above + name, read_file(folder + "/" + name));
    write_file(path, writer.finish());
}

TEST_F(Cameras, PhotosMayComeInAnArchive) {
    make_model("0", {"0.png", "1.png", "2.png", "3.png"});
    zip_folder(folder_ / "photos", folder_ / "holiday.zip", "trip/");
    const std::vector<std::string> train{"train", folder_ / "holiday.zip", "-o", folder_ / "run", "--steps",
                                         "2"};
    const Outcome outcome = run(train);
    ASSERT_EQ(outcome.status, 0) << outcome.err;
    EXPECT_NE(outcome.out.find("4 of 4 photos have cameras"), std::string::npos) << outcome.out;
    EXPECT_EQ(fs::read_symlink(folder_ / "run/dataset/images"), "unpacked/trip");
    expect_success(run_ewa({"eval", folder_ / "run", "--split", "train"}));
    // Nothing is done twice, and a changed archive is noticed.
    expect_success(run({"cameras", folder_ / "holiday.zip", "-o", folder_ / "run/dataset"}));
    EXPECT_EQ(calls(), "feature_extractor\nmatches_importer\nmapper\n");
    zip_folder(folder_ / "photos", folder_ / "holiday.zip");
    expect_failure(run({"cameras", folder_ / "holiday.zip", "-o", folder_ / "run/dataset"}), 2,
                   "the archive has changed since " + folder_ / "run/dataset" + " was made of it");
    expect_failure(run({"cameras", folder_ / "holiday.zip", "-o", folder_ / "x", "--frames", "3"}), 2,
                   "--frames 3");
    expect_failure(run_ewa({"info", folder_ / "holiday.zip"}), 2, "an archive without cameras");
}

TEST_F(Cameras, ADatasetMayComeInAnArchive) {
    fs::remove(folder_ / "bin/colmap");
    zip_folder(folder_ / "source", folder_ / "scene.zip", "scene/");
    const Outcome info = run_ewa({"info", folder_ / "scene.zip"});
    expect_success(info);
    EXPECT_NE(info.out.find(folder_ / "scene.zip" + "\n"), std::string::npos) << info.out;
    EXPECT_NE(info.out.find("frames          4"), std::string::npos) << info.out;
    const std::vector<std::string> train{
        "train", folder_ / "scene.zip", "-o", folder_ / "run", "--steps", "2", "--frames", "0-2"};
    expect_success(run(train));
    EXPECT_TRUE(fs::exists(folder_ / "run/dataset/transforms.json"));
    EXPECT_FALSE(fs::exists(folder_ / "run/dataset/unpacked"));
    expect_success(run_ewa({"eval", folder_ / "run", "--split", "train"}));
    std::vector<std::string> again = train;
    again.emplace_back("--force");
    expect_success(run(again));
    EXPECT_EQ(calls(), "");
    // An entry that leads elsewhere.
    ewa::io::ArchiveWriter writer;
    writer.add("../outside.png", "x");
    write_file(folder_ / "bad.zip", writer.finish());
    expect_failure(run({"train", folder_ / "bad.zip", "-o", folder_ / "bad"}), 2,
                   folder_ / "bad.zip: \"../outside.png\" leads out of the folder");
    EXPECT_FALSE(fs::exists(folder_ / "bad"));
}

TEST_F(Cameras, TrainingPlacesPhotosFirst) {
    make_model("0", {"0.png", "1.png", "2.png", "3.png"});
    const std::vector<std::string> train = {"train", folder_ / "photos/", "-o", folder_ / "run", "--steps",
                                            "3",     "--test-every",      "0",  "--quiet"};
    const Outcome outcome = run(train);
    ASSERT_EQ(outcome.status, 0) << outcome.err;
    EXPECT_TRUE(fs::exists(folder_ / "run/splats.ply"));
    EXPECT_TRUE(fs::exists(folder_ / "run/dataset/sparse/0/images.bin"));
    const auto config = read_json(folder_ / "run/config.json");
    EXPECT_EQ(fs::path(config.at("dataset").get<std::string>()).filename(), "photos");

    // The run is known by the dataset that it has made.
    expect_success(run_ewa({"eval", folder_ / "run", "--split", "train", "--json", folder_ / "e.json"}));
    EXPECT_EQ(read_json(folder_ / "e.json")["frames"].size(), 4u);
    expect_success(run_ewa({"render", folder_ / "run", "-o", folder_ / "views"}));
    EXPECT_EQ(files_below(folder_ / "views").size(), 4u);
}

/// The pictures that a training in the folder of the photos leaves are no new photos.
TEST_F(Cameras, ResultsBesideThePhotosAreNoPhotos) {
    make_model("0", {"0.png", "1.png", "2.png", "3.png"});
    const std::vector<std::string> train = {
        "train", folder_ / "photos", "-o", folder_ / "photos/run", "--steps", "2", "--quiet"};
    expect_success(run(train));
    const std::vector<std::string> files = files_below(folder_ / "photos/run");
    EXPECT_GT(std::ranges::count_if(files, [](const auto& name) { return name.ends_with(".png"); }), 0);
    std::vector<std::string> again = train;
    again.emplace_back("--force");
    expect_success(run(again));
    EXPECT_EQ(calls(), "feature_extractor\nmatches_importer\nmapper\n");
}

/// A film of 20 real photos, where COLMAP, ffmpeg and the photos are on this machine.
TEST(RealCapture, OfAFilmPlacesItsFrames) {
    const auto photos = shared_data();
    if (!photos || ewa::core::find_program("colmap").empty() || ewa::core::find_program("ffmpeg").empty())
        GTEST_SKIP() << "no COLMAP, no ffmpeg, or no photos";
    const Folder folder;
    const std::string film = folder / "film.mp4";
    const std::string make = "ffmpeg -v error -framerate 10 -pattern_type glob -i '" +
                             (*photos / "fox_270/images/*.jpg").string() +
                             "' -frames:v 20 -c:v mpeg4 -q:v 1 " + film;
    ASSERT_EQ(std::system(make.c_str()), 0);
    const Outcome outcome = run_ewa({"cameras", film, "-o", folder / "dataset", "--matching", "unordered"});
    ASSERT_EQ(outcome.status, 0) << outcome.err;
    const size_t end = outcome.out.rfind(" of 20 photos have cameras");
    ASSERT_NE(end, std::string::npos) << outcome.out;
    EXPECT_GE(std::stoi(outcome.out.substr(outcome.out.rfind(' ', end - 1) + 1)), 15) << outcome.out;
}

}  // namespace
