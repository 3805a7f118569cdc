// SPDX-License-Identifier: Apache-2.0
// ewa convert to and from the levels of a streamed SOG, also against splat-transform where it is installed.
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>

#include "cli/expect.h"
#include "ewa/splat_files.h"
#include "support/splat_scenes.h"

namespace {

using namespace ewa::test;

TEST(ConvertLevels, WritesReadsAndTells) {
    const Folder folder;
    ewa::save_splats(folder / "s.ply", storable_splats(4, 1000, 1));
    const Outcome written =
        run_ewa({"convert", folder / "s.ply", folder / "lod/lod-meta.json", "--levels", "3"});
    expect_success(written);
    EXPECT_NE(written.out.find("levels of 1000, 500, 250 splats"), std::string::npos) << written.out;
    const Outcome told = run_ewa({"info", folder / "lod/lod-meta.json"});
    expect_success(told);
    EXPECT_NE(told.out.find("level 0 of 3 with 1000, 500, 250 splats"), std::string::npos) << told.out;
    for (const auto& [level, splats] : {std::pair{"0", 1000u}, {"1", 500u}, {"2", 250u}}) {
        expect_success(
            run_ewa({"convert", folder / "lod/lod-meta.json", folder / "o.ply", "--level", level}));
        EXPECT_EQ(ewa::load_splats(folder / "o.ply").size(), splats);
    }
}

TEST(ConvertLevels, WrongUse) {
    const Folder folder;
    ewa::save_splats(folder / "s.ply", storable_splats(4, 100, 0));
    const std::string levels = folder / "lod/lod-meta.json";
    expect_success(run_ewa({"convert", folder / "s.ply", levels}));
    expect_failure(run_ewa({"convert", levels, folder / "o.ply", "--level", "1"}), 2, "no level 1");
    expect_failure(run_ewa({"convert", folder / "s.ply", folder / "o.ply", "--level", "1"}), 2, "no levels");
    expect_failure(run_ewa({"convert", folder / "s.ply", folder / "o.ply", "--levels", "2"}), 2, "--levels");
    expect_failure(run_ewa({"convert", folder / "s.ply", folder / "lod-meta.json", "--check"}), 2, "--check");
    expect_failure(run_ewa({"convert", levels, levels}), 2, "lod-meta.json");
    expect_failure(run_ewa({"convert", folder / "lod/0_0/meta.json", levels}), 2, "another folder");
}

TEST(ConvertLevels, TheJsonCountsTheBytesOfAllFiles) {
    const Folder folder;
    ewa::save_splats(folder / "s.ply", storable_splats(4, 4000, 0));
    for (const std::string name : {"tileset.json", "page.html", "lod-meta.json"}) {
        SCOPED_TRACE(name);
        const std::string out = folder / name.substr(0, name.find('.')) + "/" + name;
        std::vector<std::string> arguments = {"convert", folder / "s.ply", out, "--levels", "2",
                                              "--json",  folder / "o.json"};
        if (name == "page.html") arguments.push_back("--unbundled");
        const Outcome outcome = run_ewa(arguments);
        expect_success(outcome);
        EXPECT_NE(outcome.out.find("the values of this"), std::string::npos) << outcome.out;
        size_t all = 0;
        for (const auto& entry :
             std::filesystem::recursive_directory_iterator(std::filesystem::path(out).parent_path()))
            if (entry.is_regular_file()) all += entry.file_size();
        const auto written = read_json(folder / "o.json")["output"];
        EXPECT_EQ(written["bytes"].get<size_t>() + written["values"]["bytes"].get<size_t>(), all);
    }
}

TEST(ConvertLevels, SplatTransformReadsThem) {
    if (std::system("command -v splat-transform > /dev/null 2>&1") != 0)
        GTEST_SKIP() << "splat-transform (npm) is not installed";
    const Folder folder;
    ewa::save_splats(folder / "s.ply", storable_splats(4, 1000, 1));
    expect_success(run_ewa({"convert", folder / "s.ply", folder / "lod/lod-meta.json", "--levels", "2"}));
    const auto transform = [](const std::string& arguments) {
        return std::system(("splat-transform -w -q -g cpu " + arguments + " > /dev/null 2>&1").c_str());
    };
    ASSERT_EQ(transform((folder / "lod/lod-meta.json") + " --select-lod 1 " + (folder / "t.ply")), 0);
    EXPECT_EQ(ewa::load_splats(folder / "t.ply").size(), 500u);
}

}  // namespace
