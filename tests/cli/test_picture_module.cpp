// SPDX-License-Identifier: Apache-2.0
// The module with OpenImageIO (src/image/openimageio.h): where it is found, one line where it is missing or
// does not fit, and all that works without it.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>

#include "cli/expect.h"
#include "ewa/image.h"

namespace {

using namespace ewa;
using namespace ewa::test;

const std::string kModule = "libewa_openimageio.so";

/// The program in a folder of its own, the folder in which it looks for its module, and two EXR files.
class PictureModule : public testing::Test {
  protected:
    void SetUp() override {
        std::filesystem::create_directories(folder_ / "bin/modules");
        std::error_code elsewhere;  // under the sanitizers the program has a quarter of a gigabyte
        std::filesystem::create_hard_link(EWA_PROGRAM, program_, elsewhere);
        if (elsewhere) std::filesystem::copy_file(EWA_PROGRAM, program_);
        for (const char* name : {"a.exr", "b.exr"}) save_image(folder_ / name, Image(8, 8, 3));
    }
    void install_module() const { std::filesystem::copy_file(EWA_OPENIMAGEIO_MODULE, module_); }
    Outcome run(const std::vector<std::string>& arguments, Circumstances circumstances = {}) const {
        if (circumstances.program.empty()) circumstances.program = program_;
        return run_ewa(arguments, circumstances);
    }
    Outcome compare(Circumstances circumstances = {}) const {
        return run({"compare", folder_ / "a.exr", folder_ / "b.exr"}, std::move(circumstances));
    }

    Folder folder_;
    const std::string program_ = folder_ / "bin/ewa", module_ = folder_ / ("bin/modules/" + kModule);
};

TEST_F(PictureModule, IsFoundBesideTheProgram) {
    install_module();
    expect_success(compare());
}

/// /usr/local/bin/ewa may be a link to the place where ewa is installed.
TEST_F(PictureModule, IsFoundThroughALinkToTheProgram) {
    install_module();
    Circumstances circumstances;
    circumstances.program = folder_ / "link";
    std::filesystem::create_symlink(program_, circumstances.program);
    expect_success(compare(circumstances));
}

/// A stranger's scene could bring a library.
TEST_F(PictureModule, IsNotTakenFromWhereElseLibrariesAreLookedFor) {
    install_module();
    const std::string other = folder_ / "other";
    std::filesystem::create_directory(other);
    test::write_file(other + "/" + kModule, std::string(5000, 'x'));
    Circumstances circumstances;
    circumstances.environment = {{"LD_LIBRARY_PATH", other}};
    expect_success(compare(circumstances));
}

#ifndef __SANITIZE_ADDRESS__  // which takes terabytes of address space
/// Its libraries would hang, or end the process, where they cannot start their threads.
TEST_F(PictureModule, IsNotLoadedWithoutRoom) {
    install_module();
    for (const size_t megabytes : {200, 300, 400}) {
        Circumstances circumstances;
        circumstances.address_limit = megabytes << 20;
        const Outcome outcome = compare(circumstances);
        expect_failure(outcome, 1,
                       "this process may use only " + std::to_string(megabytes) + " MiB of address space");
        EXPECT_EQ(outcome.err.find("install"), std::string::npos) << outcome.err;
    }
}

TEST(AddressSpace, ThatIsShortIsNamedByTheDevice) {
    Circumstances circumstances;
    circumstances.address_limit = 100u << 20;
    const Outcome outcome = run_ewa({"devices"}, circumstances);
    expect_failure(outcome, 1, "this process may use only 100 MiB of address space (ulimit -v)");
}
#endif

TEST_F(PictureModule, IsNamedWhereItIsMissing) {
    const Outcome outcome = compare();
    expect_failure(outcome, 1, folder_ / "a.exr: " + kModule);
    expect_failure(outcome, 1, "it is neither in " + folder_ / "lib/");
    expect_failure(outcome, 1, "nor in the folders ewa and modules beside " + program_);
    expect_failure(outcome, 1, "install ewa's module and OpenImageIO (apt install libopenimageio-dev)");
    test::write_file(folder_ / "a.tif",
                     read_file(std::string(EWA_SOURCE_DIR) + "/tests/fuzz/seeds/read_picture/plain.tif"));
    expect_failure(run({"compare", folder_ / "a.tif", folder_ / "a.tif"}), 1, folder_ / "a.tif: " + kModule);
}

/// A machine without OpenImageIO trains from start to report on JPEG images, and uses the result.
TEST_F(PictureModule, IsNotNeededForJpegAndPng) {
    const std::string data = std::string(EWA_SOURCE_DIR) + "/scenes/still_life", out = folder_ / "out",
                      views = folder_ / "views", copies = folder_ / "copies";
    expect_success(run({"train", data, "-o", out, "--steps", "4", "--downscale", "4", "--quiet"}));
    const std::vector<std::string> written = files_below(out);
    for (const char* name : {"report.html", "summary.json", "splats.ply"})
        EXPECT_TRUE(std::ranges::count(written, name)) << name;
    EXPECT_NE(read_file(out + "/report.html").find("data:image/jpeg;base64,"), std::string::npos);
    const std::string splats = out + "/splats.ply";
    for (const std::string& to : {views, copies})
        EXPECT_EQ(run({"render", splats, "--cameras", data, "--downscale", "4", "--frames", "test", "-o", to})
                      .status,
                  0);
    EXPECT_EQ(run({"compare", views, copies, "--max-error", "0"}).status, 0);
    EXPECT_EQ(run({"eval", splats, data, "--downscale", "4"}).status, 0);
    const Outcome exr = run(
        {"render", splats, "--cameras", data, "--frames", "0", "--format", "exr", "-o", views, "--quiet"});
    expect_failure(exr, 1, kModule);
}

/// Before the training begins, and with nothing written.
TEST_F(PictureModule, IsMissedWithTheFirstImageOfADataset) {
    make_dataset(folder_ / "scene", {"0.png", "1.exr", "2.png", "3.png"});
    const std::string out = folder_ / "out";
    expect_failure(run({"train", folder_ / "scene", "-o", out, "--steps", "100000", "--quiet"}), 1,
                   "1.exr: " + kModule);
    EXPECT_FALSE(std::filesystem::exists(out));
}

TEST_F(PictureModule, ThatIsNoLibraryIsOneLine) {
    test::write_file(module_, read_file(EWA_OPENIMAGEIO_MODULE).substr(0, 60));
    expect_failure(compare(), 1, kModule + ": file too short");
    test::write_file(module_, std::string(5000, 'x'));
    expect_failure(compare(), 1, "invalid ELF header");
}

TEST_F(PictureModule, OfAnotherVersionIsRefused) {
    std::filesystem::copy_file(EWA_OTHER_VERSION_MODULE, module_);
    expect_failure(compare(), 1, "it belongs to ewa 0.0.0, and this is " EWA_VERSION);
}

TEST_F(PictureModule, WithoutItsEntryIsRefused) {
    std::filesystem::copy_file(EWA_FAULTS_LIBRARY, module_);
    expect_failure(compare(), 1, "it belongs to another build of ewa");
}

/// The same version does not mean the same layout: both may be builds of one day's work.
TEST_F(PictureModule, OfAnotherLayoutIsRefused) {
    std::string bytes = read_file(EWA_OPENIMAGEIO_MODULE);
    const std::string entry = "ewa_openimageio_layout_";
    size_t found = 0;
    for (size_t at = bytes.find(entry); at != std::string::npos; at = bytes.find(entry, at + 1), ++found)
        bytes[at + entry.size()] = '0';
    ASSERT_GT(found, 0u);
    test::write_file(module_, bytes);
    expect_failure(compare(), 1, "it belongs to another build of ewa");
}

}  // namespace
