// SPDX-License-Identifier: Apache-2.0
// The split of a transforms.json: nerfstudio's lists of names, and Blender's file of validation.
#include <nlohmann/json.hpp>

#include "ewa/dataset.h"
#include "support/transforms_scene.h"

namespace {

using namespace ewa;
using namespace ewa::test;
using nlohmann::json;

/// Six images, and the names of those that train and that are held out.
class NamedSplits : public testing::Test {
  protected:
    void SetUp() override {
        scene_.model["frames"] = json::array();
        for (int i = 0; i < 6; ++i) {
            const std::string name = "images/" + std::to_string(i) + ".png";
            save_image(scene_.folder / name, Image(8, 6, 3));
            scene_.model["frames"].push_back(transforms_frame(name));
        }
    }

    void expect_split(const std::vector<int>& train, const std::vector<int>& test) {
        dataset_ = scene_.load();
        for (const int every : {0, 2}) {
            const Split split = split_frames(dataset_, every);
            EXPECT_EQ(split.train, train);
            EXPECT_EQ(split.test, test);
        }
    }
    void expect_note(const std::string& text) const {
        std::string all;
        for (const std::string& note : dataset_.notes) all += note + "\n";
        EXPECT_NE(all.find(text), std::string::npos) << all;
    }

    TransformsScene scene_;
    Dataset dataset_;
};

TEST_F(NamedSplits, ValAndTestAreHeldOut) {
    scene_.model["train_filenames"] = {"images/0.png", "images/2.png", "images/3.png", "images/5.png"};
    scene_.model["val_filenames"] = {"images/1.png"};
    scene_.model["test_filenames"] = {"images/4.png"};
    expect_split({0, 2, 3, 5}, {1, 4});
    expect_note("split by names: 4 images to train, 1 of val_filenames and 1 of test_filenames held out");
    EXPECT_EQ(dataset_.notes.size(), 1u);
}

TEST_F(NamedSplits, TheRestDependsOnWhichListsThereAre) {
    scene_.model["val_filenames"] = {"images/1.png"};
    expect_split({0, 2, 3, 4, 5}, {1});
    scene_.model["train_filenames"] = {"images/0.png", "images/2.png"};
    expect_split({0, 2}, {1});  // of three frames: the others are removed
    EXPECT_EQ(dataset_.frames.size(), 3u);
    expect_note("3 images of no list of the split are skipped");
    scene_.model.erase("val_filenames");
    expect_split({0, 2}, {1, 3, 4, 5});
    scene_.model["train_filenames"] = json::array();
    scene_.model["test_filenames"] = nullptr;
    EXPECT_EQ(split_frames(scene_.load(), 3).test, (std::vector<int>{0, 3}));
}

/// Lists for the evaluation of what was trained name all images twice.
TEST_F(NamedSplits, NamesInBothListsTrainWhereNothingElseDoes) {
    const json all = {"images/0.png", "images/1.png", "images/2.png",
                      "images/3.png", "images/4.png", "images/5.png"};
    scene_.model["train_filenames"] = scene_.model["test_filenames"] = all;
    expect_split({0, 1, 2, 3, 4, 5}, {});
    expect_note("6 images of train_filenames are held out by another list, too");
    // One that trains alone is enough to believe the lists.
    scene_.model["test_filenames"].erase(0);
    expect_split({0}, {1, 2, 3, 4, 5});
    // Who wants to train on held-out images can.
    scene_.model.erase("train_filenames");
    scene_.model["test_filenames"] = all;
    EXPECT_TRUE(split_frames(scene_.load(), 8).train.empty());
    EXPECT_EQ(split_frames(scene_.load(), 0).train.size(), 6u);
}

TEST_F(NamedSplits, NamesMayBeWrittenElsewhere) {
    scene_.model["train_filenames"] = {"/home/me/scene/images/0.png", "images\\2.png", "./images/3", "5.JPG"};
    scene_.model["test_filenames"] = {"images_2/1.jpeg", "elsewhere/4.png", "images/9.png"};
    expect_split({0, 2, 3, 5}, {1, 4});
    expect_note("1 name of the split is of no frame, the first being images/9.png");
}

TEST_F(NamedSplits, WhatIsHeldOutDoesNotTrain) {
    scene_.model["train_filenames"] = {"images/0.png", "images/1.png", "images/2.png"};
    scene_.model["test_filenames"] = {"images/1.png"};
    expect_split({0, 2}, {1});
}

TEST_F(NamedSplits, TheFolderTellsEqualNamesApart) {
    for (const char* side : {"left", "right"}) {
        std::filesystem::create_directories(scene_.folder / side);
        save_image(scene_.folder / side / "0.png", Image(8, 6, 3));
    }
    scene_.model["frames"] = {transforms_frame("left/0.png"), transforms_frame("right/0.png")};
    scene_.model["test_filenames"] = {"/data/right/0.png"};
    expect_split({0}, {1});
    scene_.model["test_filenames"] = {"0.png"};
    scene_.refuse({"\"test_filenames\": \"0.png\" is one of 2 frames"});
}

TEST_F(NamedSplits, ListsOfOthersAreRefused) {
    scene_.model["train_filenames"] = {"a/x.png", "a/y.png"};
    scene_.refuse({"name none of the frames; \"a/x.png\" is the first name"});
    scene_.model["train_filenames"] = "images/0.png";
    scene_.refuse({"\"train_filenames\" is not a list"});
    scene_.model["train_filenames"] = {3};
    scene_.refuse({"\"train_filenames\" holds an entry that is not a string"});
}

TEST(Transforms, ValidationIsHeldOutWithoutTest) {
    const TempFolder folder;
    for (const char* set : {"train", "val", "test"}) {
        const json model = {{"fl_x", 10}, {"frames", {transforms_frame(std::string(set) + "/0.png")}}};
        folder.write(std::string("transforms_") + set + ".json", model.dump());
        std::filesystem::create_directories(folder / set);
        save_image(folder / set / "0.png", Image(8, 6, 3));
    }
    Dataset dataset = load_dataset(folder.path(), {});
    ASSERT_EQ(dataset.frames.size(), 2u);
    EXPECT_EQ(dataset.frames[0].name, "test/0.png");
    ASSERT_EQ(dataset.notes.size(), 1u);
    EXPECT_NE(dataset.notes[0].find("transforms_val.json is not used"), std::string::npos);
    std::filesystem::remove(folder / "transforms_test.json");
    dataset = load_dataset(folder.path(), {});
    ASSERT_EQ(dataset.frames.size(), 2u);
    EXPECT_EQ(dataset.frames[1].name, "val/0.png");
    EXPECT_EQ(dataset.frames[1].split, 2);
    EXPECT_TRUE(dataset.notes.empty());
}

}  // namespace
