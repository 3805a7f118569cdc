// SPDX-License-Identifier: Apache-2.0
// Cameras of other programs on the command line: what ewa info says of them, and a training on them, from a folder and an archive.
#include <gtest/gtest.h>

#include <filesystem>
#include <nlohmann/json.hpp>

#include "cli/expect.h"
#include "cli/program.h"
#include "ewa/image.h"
#include "io/splats/archive.h"

namespace {

using namespace ewa::test;
namespace fs = std::filesystem;

class Imports : public testing::Test {
  protected:
    /// A project of OpenDroneMap: four views that look along z, and some points before them.
    void SetUp() override {
        nlohmann::json shots = nlohmann::json::object(), points = nlohmann::json::object();
        for (int i = 0; i < 4; ++i) {
            const std::string name = std::to_string(i) + ".png";
            ewa::Image image(32, 24, 3);
            for (size_t k = 0; k < image.pixels.size(); ++k) image.pixels[k] = float(k % 7) / 7;
            fs::create_directories(folder_ / "odm/images");
            save_image(folder_ / "odm/images/" + name, image);
            shots[name] = {
                {"camera", "c"}, {"rotation", {0, 0.02 * i, 0}}, {"translation", {-0.1 * i, 0, 4}}};
        }
        for (int i = 0; i < 30; ++i)
            points[std::to_string(i)] = {{"coordinates", {0.03 * i - 0.5, 0.02 * (i % 9), 0.1 * (i % 4)}},
                                         {"color", {200, 8 * i, 30}}};
        const nlohmann::json camera{
            {"projection_type", "perspective"}, {"width", 32}, {"height", 24}, {"focal", 0.9}};
        const nlohmann::json list =
            nlohmann::json::array({{{"cameras", {{"c", camera}}}, {"shots", shots}, {"points", points}}});
        fs::create_directories(folder_ / "odm/opensfm");
        write_file(folder_ / "odm/opensfm/reconstruction.json", list.dump());
    }

    Folder folder_;
};

TEST_F(Imports, InfoNamesFormatAndProgram) {
    for (const char* path : {"odm", "odm/opensfm/reconstruction.json"}) {
        const Outcome text = run_ewa({"info", folder_ / path});
        expect_success(text);
        EXPECT_NE(text.out.find("kind            OpenSfM reconstruction\nprogram         OpenDroneMap\n"),
                  std::string::npos)
            << text.out;
        EXPECT_NE(text.out.find("points          30"), std::string::npos) << text.out;
    }
    const Outcome outcome = run_ewa({"info", folder_ / "odm", "--json"});
    const nlohmann::json parsed = nlohmann::json::parse(outcome.out);
    EXPECT_EQ(parsed["kind"], "OpenSfM reconstruction");
    EXPECT_EQ(parsed["program"], "OpenDroneMap");
    EXPECT_EQ(parsed["frames"], 4);
}

TEST_F(Imports, AnArchiveTrainsWithoutColmap) {
    ewa::io::ArchiveWriter writer;
    for (const std::string& name : files_below(folder_ / "odm"))
        writer.add("project/" + name, read_file(folder_ / "odm/" + name));
    write_file(folder_ / "odm.zip", writer.finish());
    const Outcome info = run_ewa({"info", folder_ / "odm.zip"});
    expect_success(info);
    EXPECT_NE(info.out.find("program         OpenDroneMap"), std::string::npos) << info.out;
    expect_success(run_ewa({"train", folder_ / "odm.zip", "-o", folder_ / "run", "--steps", "2", "--quiet"}));
    EXPECT_TRUE(fs::exists(folder_ / "run/splats.ply"));
    EXPECT_TRUE(fs::exists(folder_ / "run/dataset/opensfm/reconstruction.json"));
}

TEST_F(Imports, ProjectsOfProgramsHaveAdvice) {
    fs::create_directories(folder_ / "only");
    write_file(folder_ / "only/scene.psx", "<document/>");
    expect_failure(run_ewa({"info", folder_ / "only"}), 2, "export cameras.xml there");
    expect_failure(run_ewa({"train", folder_ / "only", "-o", folder_ / "run"}), 2, "a project of Metashape");
    for (const auto& [name, advice] : {std::pair{"scene.psx", "a project of Metashape"},
                                       {"a.rcproj", "a project of RealityCapture"},
                                       {"a.zip", "empty, or not a zip archive"},
                                       {"a.r3d", "not Record3D's archive"},
                                       {"a.xml", "not Metashape's file of cameras"},
                                       {"a.xmp", "not RealityScan's file of a camera"},
                                       {"a.csv", "not RealityScan's file of cameras"}}) {
        const std::string file = folder_ / (std::string("only/") + name);
        write_file(file, "");
        expect_failure(run_ewa({"info", file}), 2, std::string(name) + " is " + advice);
    }
}

/// The folder into which an archive was unpacked is no more.
TEST_F(Imports, ErrorsInAnArchiveNameItsEntry) {
    ewa::io::ArchiveWriter writer;
    for (const std::string& name : files_below(folder_ / "odm"))
        writer.add("project/" + name,
                   name.ends_with(".json") ? "[{\"cameras\": {}}]" : read_file(folder_ / "odm/" + name));
    write_file(folder_ / "bad.zip", writer.finish());
    const Outcome outcome = run_ewa({"info", folder_ / "bad.zip"});
    expect_failure(outcome, 2, folder_ / "bad.zip" + ": project/opensfm/reconstruction.json: ");
    EXPECT_EQ(outcome.err.find("ewa-zip-"), std::string::npos) << outcome.err;
}

}  // namespace
