// SPDX-License-Identifier: Apache-2.0
// What a run's folder is, and what a new run leaves of an earlier one.
#include "folders/run_folder.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "support/temp_folder.h"

namespace ewa::folders {
namespace {

namespace fs = std::filesystem;
using test::TempFolder;

TEST(RunFolder, IsOneWithConfigAndWhatARunBegins) {
    for (const char* other : {kMetricsFile, kSplatsFile, kCheckpointFile}) {
        TempFolder folder;
        folder.write(other, "x");
        EXPECT_FALSE(is_run(folder.path())) << other;
        EXPECT_FALSE(is_made_by_ewa(folder.path())) << other;
        folder.write(kConfigFile, "{}");
        EXPECT_TRUE(is_run(folder.path())) << other;
        EXPECT_TRUE(is_made_by_ewa(folder.path())) << other;
    }
    TempFolder other;
    other.write(kConfigFile, "{}");
    other.write(kSummaryFile, "{}");
    EXPECT_FALSE(is_run(other.path())) << "other programs write a config.json";
    other.write(kCaptureFile, "{}");
    EXPECT_TRUE(is_made_by_ewa(other.path()));
}

TEST(RunFolder, HasTheOptionsByTheirPresentNames) {
    TempFolder folder;
    const RunFolder run(folder.path());
    EXPECT_TRUE(run.options().empty());
    folder.write(kConfigFile, "[1]");
    EXPECT_TRUE(run.options().empty());
    folder.write(kConfigFile, R"({"steps": 7, "exposure": true, "appearance": "none", "antialias": false})");
    EXPECT_EQ(run.options(), nlohmann::json({{"steps", 7}, {"appearance", "affine"}}));
}

TEST(RunFolder, ResultsOfAnEarlierRunGo) {
    TempFolder folder;
    const RunFolder run(folder.path());
    for (const char* name : kRunFiles) folder.write(name, "x");
    folder.write("splats_000200.ply", "x");
    folder.write("splats_12.ply", "x");
    folder.write("cameras/sparse/0/images.bin", "x");
    EXPECT_EQ(run.kept_splats(), (std::map<int, fs::path>{{200, folder / "splats_000200.ply"}}));
    run.remove_results();
    for (const char* kept : {kConfigFile, kMetricsFile, kSplatsFile}) EXPECT_TRUE(run.has(kept)) << kept;
    for (const char* gone : {kCheckpointFile, kTimesFile, kSummaryFile, kReportFile, kSkyFile})
        EXPECT_FALSE(run.has(gone)) << gone;
    EXPECT_FALSE(run.has("cameras/sparse/0/images.bin"));
    EXPECT_FALSE(run.has("splats_000200.ply"));
    EXPECT_TRUE(run.has("splats_12.ply")) << "a run names no file so";
}

TEST(RunFolder, LinksInThePlacesOfItsFilesGo) {
    TempFolder folder;
    folder.write("other/summary.json", "x");
    fs::create_symlink(folder / "other/summary.json", folder / kSummaryFile);
    fs::create_directory_symlink(folder / "other", folder / kTestFolder);
    fs::create_directory_symlink(folder / "other", folder / "mine");
    RunFolder(folder.path()).remove_links();
    EXPECT_FALSE(fs::is_symlink(folder / kSummaryFile));
    EXPECT_FALSE(fs::is_symlink(folder / kTestFolder));
    EXPECT_TRUE(fs::is_symlink(folder / "mine"));
    EXPECT_TRUE(fs::is_regular_file(folder / "other/summary.json"));
}

}  // namespace
}  // namespace ewa::folders
