// SPDX-License-Identifier: Apache-2.0
#include "scene/names.h"

#include <gtest/gtest.h>

#include "ewa/error.h"
#include "support/temp_folder.h"

namespace {

using ewa::scene::dataset_name;
using ewa::scene::frames_named;
using Indices = std::vector<int>;

ewa::Dataset of_names(const std::vector<std::string>& names) {
    ewa::Dataset dataset;
    dataset.root = "photos";
    for (const std::string& name : names) {
        ewa::Frame frame;
        frame.name = name;
        dataset.frames.push_back(frame);
    }
    return dataset;
}

TEST(Names, FramesByIndexRangeAndName) {
    const ewa::Dataset dataset =
        of_names({"a.jpg", "a/d.jpg", "b.jpg", "b.png", "c-1.jpg", "1-2", "7.jpg", "x/d.png"});
    const std::pair<const char*, Indices> good[] = {
        {"0", {0}},           {"0,3", {0, 3}}, {"3,0,3", {3, 0}},   {"2-4", {2, 3, 4}},
        {"1,0-2", {1, 0, 2}}, {"6-6", {6}},    {"a.jpg", {0}},      {"a", {0}},
        {"a/d", {1}},         {"d.jpg", {1}},  {"d.png,1", {7, 1}}, {"c-1.jpg,0", {4, 0}},
        {"1-2", {5}},         {"5", {5}},      {"7.jpg", {6}}};
    for (const auto& [list, frames] : good) EXPECT_EQ(frames_named(dataset, list), frames) << list;
    const std::pair<const char*, const char*> bad[] = {{"8", "no frame 8: photos has 8 frames"},
                                                       {"5-8", "no frame 8"},
                                                       {"-1", "no frame -1"},
                                                       {"4-2", "end before they begin"},
                                                       {"b", "'b' is not"},  // two have that name
                                                       {"d", "'d' is not"},
                                                       {"0,", "'0,' is not"},
                                                       {"0-", "'0-' is not"},
                                                       {"2-x", "'2-x' is not"},
                                                       {"c-2.jpg", "did you mean c-1.jpg?"},
                                                       {"d.pngg", "did you mean d.png?"}};
    for (const auto& [list, mistake] : bad) try {
            frames_named(dataset, list);
            ADD_FAILURE() << list;
        } catch (const ewa::InputError& error) {
            EXPECT_NE(std::string(error.what()).find(mistake), std::string::npos)
                << list << ": " << error.what();
        }
}

TEST(Names, DatasetsAreNamedAfterTheirFolder) {
    const ewa::test::TempFolder folder;
    const std::filesystem::path photos = folder / "photos", model = photos / "sparse" / "0";
    std::filesystem::create_directories(model);
    std::filesystem::create_directories(folder / "0");
    std::filesystem::create_directories(folder / "v1.5");
    for (const auto& path : {photos, photos / "", photos / ".", model, model / "", photos / "sparse",
                             model / ".." / "0", photos / "transforms.json"})
        EXPECT_EQ(dataset_name(path), "photos") << path;
    EXPECT_EQ(dataset_name(folder / "0"), "0");
    EXPECT_EQ(dataset_name(folder / "v1.5"), "v1.5");
    EXPECT_EQ(dataset_name("/"), "dataset");
    EXPECT_EQ(dataset_name("/absent/photos"), "photos");
}

}  // namespace
