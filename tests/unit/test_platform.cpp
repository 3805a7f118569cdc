// SPDX-License-Identifier: Apache-2.0
// The calls of the operating system, as the other modules rely on them. Tests of those modules test more.
#include <chrono>
#include <cstring>
#include <string>
#include <vector>

#include "platform/file.h"
#include "platform/file_facts.h"
#include "platform/library.h"
#include "platform/process.h"
#include "platform/socket.h"
#include "platform/system.h"
#include "support/temp_folder.h"

namespace {

using namespace ewa;
using platform::Open;

TEST(Platform, FilesAreReadAndWrittenAtPlaces) {
    const test::TempFolder folder;
    platform::File file;
    ASSERT_FALSE(file.open(folder / "a", Open::create));
    EXPECT_EQ(platform::File().open(folder / "a", Open::create), std::errc::file_exists);
    EXPECT_EQ(platform::File().open(folder / "none", Open::read), std::errc::no_such_file_or_directory);
    ASSERT_FALSE(file.write("0123456789", 10));
    ASSERT_FALSE(file.go_to(2));
    ASSERT_FALSE(file.skip(3));
    char text[8] = "";
    size_t got = 0;
    ASSERT_FALSE(file.read(text, sizeof(text), got));
    EXPECT_EQ(std::string(text, got), "56789");
    ASSERT_FALSE(file.read(text, sizeof(text), got));
    EXPECT_EQ(got, 0u);
    uint64_t size = 0;
    ASSERT_FALSE(file.size(size));
    EXPECT_EQ(size, 10u);
    EXPECT_FALSE(file.flush());
    EXPECT_FALSE(file.close());
    ASSERT_FALSE(file.open(folder / "a", Open::append));
    ASSERT_FALSE(file.write("x", 1));
    EXPECT_EQ(test::file_bytes(folder / "a"), "0123456789x");
}

TEST(Platform, FilesAreLockedReplacedAndRemoved) {
    const test::TempFolder folder;
    platform::File first, second;
    ASSERT_FALSE(first.open(folder / "a", Open::edit));
    EXPECT_FALSE(platform::is_locked(folder / "a"));
    EXPECT_EQ(first.try_lock(), platform::Lock::locked);
    EXPECT_TRUE(platform::is_locked(folder / "a"));
    ASSERT_FALSE(second.open(folder / "a", Open::edit));
    EXPECT_EQ(second.try_lock(), platform::Lock::taken);
    ASSERT_FALSE(first.write("locked", 6));
    EXPECT_EQ(test::file_bytes(folder / "a"), "locked");  // a lock keeps nobody from reading
    first.close();
    EXPECT_EQ(second.try_lock(), platform::Lock::locked);
    second.close();
    folder.write("b", "new");
    ASSERT_FALSE(platform::replace(folder / "b", folder / "a"));
    EXPECT_EQ(test::file_bytes(folder / "a"), "new");
    platform::remove_now((folder / "a").c_str());
    EXPECT_EQ(test::files_in(folder.path()), 0u);
}

TEST(Platform, FilesAreKnownByTheirIds) {
    const test::TempFolder folder;
    folder.write("a", "");
    folder.write("b", "");
    std::filesystem::create_hard_link(folder / "a", folder / "c");
    EXPECT_EQ(platform::file_id(folder / "a"), platform::file_id(folder / "c"));
    EXPECT_NE(platform::file_id(folder / "a"), platform::file_id(folder / "b"));
    EXPECT_EQ(platform::file_id(folder.path()), platform::file_id(folder / "."));
    EXPECT_FALSE(platform::file_id(folder / "absent"));
}

TEST(Platform, WriteTimesAreFinerThanASecond) {
    const test::TempFolder folder;
    const auto file = folder.write("a", "x");
    std::error_code error;
    const auto first = platform::write_time(file, error);
    ASSERT_FALSE(error);
    auto later = first;
    // Until the clock of the file system goes on.
    for (int i = 0; later == first; ++i)
        later = platform::write_time(folder.write("a", std::to_string(i)), error);
    EXPECT_GT(later, first);
    EXPECT_NE((later - first) % std::chrono::seconds(1), std::chrono::seconds(0));
    EXPECT_LT(std::chrono::abs(later - std::filesystem::last_write_time(file)), std::chrono::seconds(1));
    platform::write_time(folder / "absent", error);
    EXPECT_EQ(error, std::errc::no_such_file_or_directory);
}

TEST(Platform, PathsAreMadeOfUtf8) {
    const std::filesystem::path path("caf\xc3\xa9/\xf0\x9f\x98\x80");
    EXPECT_EQ(path.generic_u16string(), u"caf\u00e9/\U0001F600");
    const test::TempFolder folder;
    EXPECT_EQ(test::file_bytes(folder.write(std::filesystem::path(u"\u65e5.txt"), "x")), "x");
    EXPECT_TRUE(std::filesystem::exists(folder / "\xe6\x97\xa5.txt"));
    EXPECT_FALSE(std::filesystem::exists(folder / "\xff\xc3")) << "no UTF-8, and no error";
}

TEST(Platform, SpellingsOfOneFileAreFolded) {
    const test::TempFolder folder;
    folder.write("\xc3\x84.txt", "x");
    const bool one = std::filesystem::exists(folder / "\xc3\xa4.TXT");
    EXPECT_EQ(platform::folded(folder / "\xc3\x84.txt") == platform::folded(folder / "\xc3\xa4.TXT"), one);
    EXPECT_EQ(platform::folded("a/b"), platform::folded(std::filesystem::path("a") / "b"));
    EXPECT_TRUE(platform::folded({}).empty());
}

TEST(Platform, AFolderShowsTheFilesOfAnother) {
    const test::TempFolder folder;
    folder.write("from/below/a", "text");
    ASSERT_FALSE(platform::link_folder("from", folder / "to"));
    EXPECT_EQ(test::file_bytes(folder / "to/below/a"), "text");
    EXPECT_EQ(platform::link_folder("from", folder / "to"), std::errc::file_exists);
    EXPECT_FALSE(platform::refuses_files(folder.path()));
    EXPECT_TRUE(platform::refuses_files(folder / "absent"));
    EXPECT_EQ(test::files_in(folder.path()), 2u);
}

TEST(Platform, StreamsReadBytes) {
    const test::TempFolder folder;
    const std::string text = "a\r\nb\x1a";  // what a text mode changes
    char read[8] = "";
    std::FILE* stream = platform::stream_of(text.data(), text.size());
    ASSERT_TRUE(stream);
    EXPECT_EQ(std::string(read, std::fread(read, 1, sizeof(read), stream)), text);
    std::fclose(stream);
    stream = platform::open_stream(folder.write("a", text));
    ASSERT_TRUE(stream);
    EXPECT_EQ(std::string(read, std::fread(read, 1, sizeof(read), stream)), text);
    std::fclose(stream);
    EXPECT_EQ(platform::open_stream(folder / "absent"), nullptr);
}

TEST(Platform, APassingFileIsReadByItsPath) {
    platform::PassingFile passing;
    ASSERT_FALSE(passing.error());
    ASSERT_FALSE(passing.file().write("text", 4));
    platform::File reader;
    ASSERT_FALSE(reader.open(passing.path(), Open::read));
    char text[8] = "";
    size_t got = 0;
    ASSERT_FALSE(reader.read(text, sizeof(text), got));
    EXPECT_EQ(std::string(text, got), "text");
}

TEST(Platform, AProgramThatHasEndedTakesNoInput) {
    const auto program = platform::find_program("true");
    if (program.empty()) GTEST_SKIP() << "no program true";
    platform::PipeTo input;
    ASSERT_FALSE(input.open());
    platform::Process process;
    ASSERT_FALSE(process.start({program.string()}, {}, {.input = input.from.handle()}));
    EXPECT_TRUE(process.is_open());
    EXPECT_TRUE(platform::is_running(process.id()));
    EXPECT_EQ(process.wait().code(), 0);
    EXPECT_FALSE(process.is_open());
    input.from.close();
    const std::vector<char> much(1u << 20);
    EXPECT_TRUE(input.write(much.data(), much.size()));  // an error, and this process lives
    EXPECT_EQ(process.start({program.string() + "-absent"}, {}, {}), std::errc::no_such_file_or_directory);
}

TEST(Platform, AProgramEndsWhenAsked) {
    const auto program = platform::find_program("sleep");
    if (program.empty()) GTEST_SKIP() << "no program sleep";
    platform::Process process;
    ASSERT_FALSE(process.start({program.string(), "1000"}, {}, {}));
    EXPECT_FALSE(process.has_ended());
    process.ask_to_end();
    EXPECT_NE(process.wait().code(), 0);
}

TEST(Platform, TheMachineIsDescribed) {
    EXPECT_TRUE(platform::is_running(platform::process_id()));
    EXPECT_GT(platform::installed_memory(), uint64_t(1) << 20);
    EXPECT_LT(platform::free_memory().value_or(0), platform::installed_memory() * 64);
    EXPECT_GT(platform::peak_memory(), 0u);
    EXPECT_FALSE(platform::machine_name().empty());
    uint64_t cores = 0;
    for (const uint64_t word : platform::usable_cores(128)) cores |= word;
    EXPECT_NE(cores, 0u);
    unsigned char secret[16] = {}, other[16] = {};
    EXPECT_TRUE(platform::random_bytes(secret, sizeof(secret)) &&
                platform::random_bytes(other, sizeof(other)));
    EXPECT_NE(std::memcmp(secret, other, sizeof(secret)), 0);
    EXPECT_TRUE(platform::Reservation(1u << 20));
    EXPECT_TRUE(platform::is_ipv4("127.0.0.1") && !platform::is_ipv4("localhost") &&
                platform::is_ipv6("::1"));
}

TEST(Platform, VariablesAreSet) {
    platform::set_if_absent("EWA_TEST_PLATFORM", "first");
    platform::set_if_absent("EWA_TEST_PLATFORM", "second");
    EXPECT_EQ(platform::variable("EWA_TEST_PLATFORM"), "first");
    platform::set_variable("EWA_TEST_PLATFORM", "\xc3\xa4");
    EXPECT_EQ(platform::variable("EWA_TEST_PLATFORM"), "\xc3\xa4");
    EXPECT_EQ(platform::variable("EWA_TEST_PLATFORM_ABSENT"), "");
}

TEST(Platform, LibrariesTellWhyTheyAreNotLoaded) {
    const test::TempFolder folder;
    platform::Library absent(folder / "libabsent.so");
    EXPECT_FALSE(absent);
    EXPECT_FALSE(absent.error().empty());
    EXPECT_EQ(absent.find("anything"), nullptr);
    std::error_code error;
    EXPECT_TRUE(std::filesystem::exists(platform::own_program(error)));
    EXPECT_TRUE(std::filesystem::exists(platform::own_file(error)));
}

}  // namespace
