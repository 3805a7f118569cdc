// SPDX-License-Identifier: Apache-2.0
// What a path names.
#include "capture/what_is.h"

#include <gtest/gtest.h>

#include "ewa/gaussians.h"
#include "ewa/image.h"
#include "ewa/splat_files.h"
#include "support/temp_folder.h"

namespace ewa {
namespace {

void save_grey_image(const std::filesystem::path& path) {
    std::filesystem::create_directories(path.parent_path());
    save_image(path, Image(8, 8, 3));
}

TEST(WhatIs, Folders) {
    const test::TempFolder folder;
    EXPECT_EQ(what_is(folder / "nothere"), What::nothing);
    EXPECT_EQ(what_is(folder.path()), What::nothing);
    folder.write("run/config.json", "{}");
    folder.write("run/metrics.jsonl", "");
    EXPECT_EQ(what_is(folder / "run"), What::run);
    folder.write("run/transforms.json", "{}");
    EXPECT_EQ(what_is(folder / "run"), What::dataset) << "a folder that is both is a dataset";
    folder.write("films/a.mp4", "x");
    EXPECT_EQ(what_is(folder / "films"), What::video);
    save_grey_image(folder / "photos/a.png");
    EXPECT_EQ(what_is(folder / "photos"), What::photos);
    folder.write("photos/a.mp4", "x");
    EXPECT_EQ(what_is(folder / "photos"), What::photos) << "videos beside photos do not count";
}

TEST(WhatIs, Files) {
    const test::TempFolder folder;
    EXPECT_EQ(what_is(folder.write("a.mp4", "x")), What::video);
    EXPECT_EQ(what_is(folder.write("transforms.json", "{}")), What::dataset);
    EXPECT_EQ(what_is(folder.write("meta.json", "{}")), What::splats);
    EXPECT_EQ(what_is(folder.write("other.json", R"({"means": {}, "quats": {}})")), What::splats);
    EXPECT_EQ(what_is(folder.write("a.ply", "x")), What::splats);
    EXPECT_EQ(what_is(folder.write("a.zip", "x")), What::splats) << "it does not begin as an archive";
    EXPECT_EQ(what_is(folder.write("empty.glb", "")), What::mesh) << "by its name";
    save_grey_image(folder / "a.png");
    EXPECT_EQ(what_is(folder / "a.png"), What::image);
    EXPECT_EQ(what_is(EWA_SOURCE_DIR "/scenes/plaster.gltf"), What::mesh);
    Gaussians splats;
    splats.resize(3);
    for (float& w : splats.quaternions) w = 1;
    save_splats(folder / "s.glb", splats);
    EXPECT_EQ(what_is(folder / "s.glb"), What::splats);
}

}  // namespace
}  // namespace ewa
