// SPDX-License-Identifier: Apache-2.0
// The driver that downloads of ewa carry, and machines without Vulkan. Debian's driver takes the part of ewa's own.
#include <gtest/gtest.h>

#include <filesystem>

#include "cli/expect.h"

namespace {

using namespace ewa::test;
namespace fs = std::filesystem;

const fs::path kSystemIcd = "/usr/lib/x86_64-linux-gnu/libvulkan_lvp.so";

class OwnDriver : public testing::Test {
  protected:
    void SetUp() override {
        if (!fs::exists(kSystemIcd)) GTEST_SKIP() << "Mesa's driver is elsewhere on this system";
        fs::create_directories(folder_ / "modules");
        fs::create_directories(folder_ / "broken");
        fs::copy_file(EWA_PROGRAM, program_);
        fs::create_symlink(kSystemIcd, folder_ / "modules/libvulkan_lvp.so");
        write_file(folder_ / "broken/libvulkan.so.1", "no library");
    }

    Outcome run(const std::vector<std::string>& arguments,
                std::vector<std::pair<std::string, std::string>> environment) const {
        Circumstances circumstances;
        circumstances.program = program_;
        circumstances.environment = std::move(environment);
        return run_ewa(arguments, circumstances);
    }
    std::vector<std::pair<std::string, std::string>> without_loader() const {
        return {{"LD_LIBRARY_PATH", folder_ / "broken"}};
    }
    /// The name of the only device.
    std::string device(std::vector<std::pair<std::string, std::string>> environment) const {
        const Outcome outcome = run({"devices", "--json"}, std::move(environment));
        expect_success(outcome);
        const auto json = nlohmann::json::parse(outcome.out);
        EXPECT_EQ(json.size(), 1u) << outcome.out;
        return json.at(0).at("name");
    }

    Folder folder_;
    const std::string program_ = folder_ / "ewa";
};

TEST_F(OwnDriver, IsTheLastChoice) {
    EXPECT_TRUE(device(without_loader()).ends_with(" inside ewa"));
    EXPECT_TRUE(device({{"VK_LOADER_DRIVERS_DISABLE", "*"}}).ends_with(" inside ewa"));
    // A loader that lacks functions: the driver exports none that programs call.
    fs::create_directories(folder_ / "old");
    fs::create_symlink(kSystemIcd, folder_ / "old/libvulkan.so.1");
    EXPECT_TRUE(device({{"LD_LIBRARY_PATH", folder_ / "old"}}).ends_with(" inside ewa"));
    const Outcome system = run({"devices"}, {});
    expect_success(system);
    EXPECT_EQ(system.out.find(" inside ewa"), std::string::npos) << system.out;
}

TEST_F(OwnDriver, DriversOfTheEnvironmentAreUsedAlone) {
    expect_failure(run({"devices"}, {{"VK_DRIVER_FILES", "/dev/null"}, {"VK_ICD_FILENAMES", "/dev/null"}}), 1,
                   "VK_DRIVER_FILES names /dev/null alone");
}

TEST_F(OwnDriver, TrainsToTheBytesOfTheSystemsDriver) {
    make_dataset(folder_ / "data");
    make_splats(folder_ / "s.ply");
    const std::vector<std::string> train = {"train", folder_ / "data", "--init", folder_ / "s.ply", "--steps",
                                            "20",    "--quiet",        "-o"};
    std::vector<std::string> inside = train, system = train;
    inside.push_back(folder_ / "inside");
    system.push_back(folder_ / "system");
    expect_success(run(inside, without_loader()));
    expect_success(run(system, {}));
    EXPECT_EQ(read_file(folder_ / "inside/splats.ply"), read_file(folder_ / "system/splats.ply"));
    EXPECT_NE(read_file(folder_ / "inside/summary.json").find(" inside ewa"), std::string::npos);
}

TEST_F(OwnDriver, DoctorNamesIt) {
    const Outcome outcome = run({"doctor", "-o", folder_ / "out"}, without_loader());
    EXPECT_EQ(outcome.status, 0) << outcome.err;
    EXPECT_NE(outcome.out.find(" inside ewa (cpu"), std::string::npos) << outcome.out;
}

TEST_F(OwnDriver, KnowsNoValidationLayer) {
    make_splats(folder_ / "s.ply");
    expect_failure(
        run({"render", folder_ / "s.ply", "-o", folder_ / "a.png", "--validation"}, without_loader()), 2,
        "validation layer is not installed");
}

/// Files need no Vulkan. What needs it names what to install.
TEST_F(OwnDriver, WithoutOneAndWithoutALoaderFilesWork) {
    fs::remove(folder_ / "modules/libvulkan_lvp.so");
    make_splats(folder_ / "s.ply");
    expect_success(run({"convert", folder_ / "s.ply", folder_ / "s.spz"}, without_loader()));
    expect_failure(run({"render", folder_ / "s.ply", "-o", folder_ / "a.png"}, without_loader()), 1,
                   "there is no Vulkan loader (libvulkan.so.1)");
    const Outcome devices = run({"devices"}, without_loader());
    expect_failure(devices, 1, "mesa-vulkan-drivers");
}

/// A file that is no driver is no reason to fail in another way.
TEST_F(OwnDriver, ThatIsBrokenIsNone) {
    fs::remove(folder_ / "modules/libvulkan_lvp.so");
    write_file(folder_ / "modules/libvulkan_lvp.so", "no library");
    expect_failure(run({"devices"}, without_loader()), 1, "there is no Vulkan loader (libvulkan.so.1)");
}

}  // namespace
