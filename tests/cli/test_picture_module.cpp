// SPDX-License-Identifier: Apache-2.0
// The module behind which OpenImageIO stands (src/image/openimageio.h): found beside the program, and one
// line where it is not there or does not fit.
#include <gtest/gtest.h>
#include <link.h>

#include <algorithm>
#include <cstddef>
#include <filesystem>
#include <utility>

#include "cli/expect.h"
#include "ewa/image.h"

namespace {

using namespace ewa;
using namespace ewa::test;

const std::string kModule = "libewa_openimageio.so";

/// The program in a folder of its own, which looks for the module in another beside itself, and two pictures.
class PictureModule : public testing::Test {
  protected:
    void SetUp() override {
        std::filesystem::create_directories(folder_ / "bin/modules");
        std::error_code elsewhere;  // under the sanitizers the program has a quarter of a gigabyte
        std::filesystem::create_hard_link(EWA_PROGRAM, program_, elsewhere);
        if (elsewhere) std::filesystem::copy_file(EWA_PROGRAM, program_);
        for (const char* name : {"a.png", "b.png"}) save_image(folder_ / name, Image(8, 8, 3));
    }
    Outcome run(const std::vector<std::string>& arguments) const {
        Circumstances circumstances;
        circumstances.program = program_;
        return run_ewa(arguments, circumstances);
    }
    Outcome compare() const { return run({"compare", folder_ / "a.png", folder_ / "b.png"}); }

    Folder folder_;
    const std::string program_ = folder_ / "bin/ewa", module_ = folder_ / ("bin/modules/" + kModule);
};

TEST_F(PictureModule, IsFoundBesideTheProgram) {
    std::filesystem::copy_file(EWA_OPENIMAGEIO_MODULE, module_);
    expect_success(compare());
}

/// As /usr/local/bin/ewa may be one to where ewa is installed.
TEST_F(PictureModule, IsFoundThroughALinkToTheProgram) {
    std::filesystem::copy_file(EWA_OPENIMAGEIO_MODULE, module_);
    Circumstances circumstances;
    circumstances.program = folder_ / "link";
    std::filesystem::create_symlink(program_, circumstances.program);
    expect_success(run_ewa({"compare", folder_ / "a.png", folder_ / "b.png"}, circumstances));
}

/// A stranger's scene could bring one.
TEST_F(PictureModule, IsNotTakenFromWhereElseLibrariesAreLookedFor) {
    std::filesystem::copy_file(EWA_OPENIMAGEIO_MODULE, module_);
    const std::string other = folder_ / "other";
    std::filesystem::create_directory(other);
    test::write_file(other + "/" + kModule, std::string(5000, 'x'));
    Circumstances circumstances;
    circumstances.program = program_;
    circumstances.environment = {{"LD_LIBRARY_PATH", other}};
    expect_success(run_ewa({"compare", folder_ / "a.png", folder_ / "b.png"}, circumstances));
}

TEST_F(PictureModule, IsToldWhereItIsMissing) {
    const Outcome outcome = compare();
    expect_failure(outcome, 1, kModule + ", by which pictures are read and written, cannot be loaded");
    expect_failure(outcome, 1, "it is neither in " + folder_ / "lib/");
    expect_failure(outcome, 1, "nor in the folders ewa and modules beside " + program_);
    expect_failure(outcome, 1, "install ewa again");
    expect_success(run({"--version"}));
}

TEST_F(PictureModule, IsMissedBeforeATrainingBegins) {
    make_dataset(folder_ / "scene");
    const std::string out = folder_ / "out";
    expect_failure(run({"train", folder_ / "scene", "-o", out, "--steps", "100000", "--quiet"}), 1, kModule);
    EXPECT_TRUE(files_below(out).empty());
}

TEST_F(PictureModule, IsToldWhereItIsNoLibrary) {
    test::write_file(module_, read_file(EWA_OPENIMAGEIO_MODULE).substr(0, 60));
    expect_failure(compare(), 1, kModule + ": file too short");
    test::write_file(module_, std::string(5000, 'x'));
    expect_failure(compare(), 1, "invalid ELF header");
}

TEST_F(PictureModule, IsToldWhereItIsCutShort) {
    std::string whole = read_file(EWA_OPENIMAGEIO_MODULE);
    for (const bool stripped : {false, true}) {
        // Sections are for linkers; a library without a table of them loads as well.
        if (stripped)
            for (const auto& [at, bytes] : {std::pair(offsetof(ElfW(Ehdr), e_shoff), sizeof(ElfW(Off))),
                                            std::pair(offsetof(ElfW(Ehdr), e_shnum), size_t(2))})
                std::fill_n(whole.begin() + std::ptrdiff_t(at), bytes, '\0');
        test::write_file(module_, whole);
        expect_success(compare());
        for (const size_t left : {whole.size() / 8, whole.size() / 4, whole.size() / 2}) {
            test::write_file(module_, whole.substr(0, left));
            expect_failure(compare(), 1, module_ + " has lost its end");
        }
    }
}

TEST_F(PictureModule, OfAnotherVersionIsRefused) {
    std::filesystem::copy_file(EWA_OTHER_VERSION_MODULE, module_);
    expect_failure(compare(), 1, "it is of ewa 0.0.0, and this is " EWA_VERSION);
}

TEST_F(PictureModule, WithoutItsEntryIsRefused) {
    std::filesystem::copy_file(EWA_FAULTS_LIBRARY, module_);
    expect_failure(compare(), 1, "ewa_openimageio_module");
}

}  // namespace
