// SPDX-License-Identifier: Apache-2.0
// ewa doctor on machines that lack something.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>

#include "cli/expect.h"
#include "core/packages.h"
#include "ranks/plugin.h"

namespace {

using namespace ewa::test;

Outcome doctor(const Folder& folder, const Circumstances& circumstances) {
    return run_ewa({"doctor", "--json", "-o", folder / "out"}, circumstances);
}

nlohmann::json check_named(const nlohmann::json& json, const std::string& name) {
    for (const auto& check : json["checks"])
        if (check["name"] == name) return check;
    ADD_FAILURE() << "no check " << name << " in " << json;
    return {};
}

TEST(Doctor, FindsThatTrainingWorks) {
    const Folder folder;
    const Outcome outcome = doctor(folder, {});
    expect_success(outcome);
    const auto json = nlohmann::json::parse(outcome.out);
    EXPECT_TRUE(json["trains"].get<bool>());
    for (const char* name : {"Vulkan driver", "device", "training", "memory", "output folder"}) {
        EXPECT_TRUE(check_named(json, name)["works"].get<bool>()) << outcome.out;
        EXPECT_EQ(check_named(json, name)["remedy"], "") << name;
    }
    EXPECT_FALSE(std::filesystem::exists(folder / "out"));

    const Outcome text = run_ewa({"doctor", "-o", folder / "out"});
    expect_success(text);
    EXPECT_NE(text.out.find("yes  training"), std::string::npos) << text.out;
    EXPECT_TRUE(text.out.ends_with("ewa can train on this machine\n")) << text.out;
}

TEST(Doctor, NamesMissingProgramsAndTrainsWithoutThem) {
    const Folder folder;
    std::filesystem::create_directory(folder / "empty");
    const Outcome outcome =
        doctor(folder, {.environment = {{"PATH", folder / "empty"}, {"VIRTUAL_ENV", ""}}});
    expect_success(outcome);
    const auto json = nlohmann::json::parse(outcome.out);
    for (const auto& [name, detail] :
         {std::pair("videos and films", "the program ffmpeg is not there"),
          {"cameras of photos", "there is neither the program colmap nor Python's package pycolmap"}}) {
        const auto check = check_named(json, name);
        EXPECT_FALSE(check["works"].get<bool>()) << name;
        EXPECT_EQ(check["detail"], detail);
        EXPECT_EQ(check["remedy"], ewa::core::how_to_install(name == std::string("videos and films")
                                                                 ? ewa::core::Thing::ffmpeg
                                                                 : ewa::core::Thing::colmap));
    }
    EXPECT_FALSE(check_named(json, "Python package")["works"].get<bool>());
    const bool shown = std::ranges::any_of(
        json["checks"], [](const auto& check) { return check["name"] == "several processes"; });
    EXPECT_EQ(shown, ewa::ranks::has_mpi());
    if (shown) {
        EXPECT_FALSE(check_named(json, "several processes")["works"].get<bool>());
    }
}

TEST(Doctor, EndsWithOneWithoutADriver) {
    const Folder folder;
    for (const char* variable : {"VK_ICD_FILENAMES", "VK_DRIVER_FILES"}) {
        Circumstances none{
            .environment = {{"VK_ICD_FILENAMES", "/dev/null"}, {"VK_DRIVER_FILES", "/dev/null"}}};
        if (variable == std::string("VK_DRIVER_FILES")) none.environment[1].second = "";
        const Outcome outcome = doctor(folder, none);
        EXPECT_EQ(outcome.status, 1) << outcome.out;
        const auto json = nlohmann::json::parse(outcome.out);
        EXPECT_FALSE(json["trains"].get<bool>());
        EXPECT_FALSE(check_named(json, "Vulkan driver")["works"].get<bool>());
        EXPECT_EQ(check_named(json, "Vulkan driver")["remedy"],
                  ewa::core::how_to_install(ewa::core::Thing::driver));
        EXPECT_FALSE(check_named(json, "training")["works"].get<bool>());
    }
}

TEST(Doctor, EndsWithOneOnADeviceOrWithALayerThatIsNotThere) {
    const Folder folder;
    const Outcome device = run_ewa({"doctor", "-o", folder / "out", "--device", "nosuchdevice"});
    EXPECT_EQ(device.status, 1);
    EXPECT_NE(device.out.find("no usable Vulkan device matches 'nosuchdevice'"), std::string::npos)
        << device.out;
    const Outcome layer = run_ewa({"doctor", "-o", folder / "out", "--validation"},
                                  {.environment = {{"VK_LAYER_PATH", folder / "nothing"}}});
    EXPECT_EQ(layer.status, 1);
    EXPECT_NE(layer.out.find("the Khronos validation layer is not installed"), std::string::npos)
        << layer.out;
}

TEST(Doctor, EndsWithOneWhereNothingCanBeWritten) {
    const Outcome outcome = run_ewa({"doctor", "-o", "/proc/out"});
    EXPECT_EQ(outcome.status, 1);
    EXPECT_NE(outcome.out.find("no   output folder"), std::string::npos) << outcome.out;
    EXPECT_NE(outcome.out.find("-> name another folder with -o"), std::string::npos) << outcome.out;
    EXPECT_TRUE(outcome.out.ends_with("ewa cannot train on this machine\n")) << outcome.out;
}

}  // namespace
