// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <cstring>

#include "core/file_reader.h"
#include "core/text.h"
#include "support/temp_folder.h"

namespace {

using namespace ewa;
using core::FileReader;
using test::bytes_of;
using test::expect_error;
using test::TempFolder;

TEST(FileReader, ReadsValuesAndCountsBytes) {
    TempFolder folder;
    FileReader reader(folder.write("a", bytes_of(uint32_t(7)) + bytes_of(2.5) + "name" + '\0' + "xyz"));
    EXPECT_EQ(reader.size(), 20u);
    EXPECT_EQ(reader.read<uint32_t>("a"), 7u);
    EXPECT_EQ(reader.read<double>("b"), 2.5);
    EXPECT_EQ(reader.read_zero_terminated(10, "c"), "name");
    reader.skip(2, "d");
    EXPECT_EQ(reader.offset(), 19u);
    expect_error<InputError>([&] { reader.read<uint16_t>("the tail"); }, {"byte 19", "the tail"});
    EXPECT_EQ(reader.read<char>("e"), 'z');
}

// Longer than the buffer, so that every way of reading crosses its end.
TEST(FileReader, CrossesItsBuffer) {
    TempFolder folder;
    std::string bytes;
    for (uint32_t i = 0; i < 700000; ++i) bytes += bytes_of(i);
    const auto path = folder.write("a", bytes);
    FileReader values(path);
    for (uint32_t i = 0; i < 700000; ++i) ASSERT_EQ(values.read<uint32_t>("v"), i);
    FileReader skipping(path);
    skipping.skip(4, "v");
    EXPECT_EQ(skipping.read<uint32_t>("v"), 1u);
    skipping.skip(4 * 600000, "v");
    EXPECT_EQ(skipping.read<uint32_t>("v"), 600002u);
    skipping.go_to(4 * 7, "v");
    EXPECT_EQ(skipping.read<uint32_t>("v"), 7u);
    skipping.go_to(4 * 699999, "v");
    EXPECT_EQ(skipping.read<uint32_t>("v"), 699999u);
    EXPECT_EQ(skipping.remaining(), 0u);
    expect_error<InputError>([&] { skipping.go_to(bytes.size() + 1, "more"); }, {"more", "2800001"});
    FileReader whole(path);
    EXPECT_EQ(std::memcmp(whole.take(bytes.size(), "all"), bytes.data(), bytes.size()), 0);
}

TEST(FileReader, ReadsLines) {
    TempFolder folder;
    FileReader reader(folder.write("a", "one\r\n\ntwo words\nlast"));
    std::string line;
    std::vector<std::string> lines;
    while (reader.read_line(line, 100)) lines.push_back(line);
    EXPECT_EQ(lines, (std::vector<std::string>{"one", "", "two words", "last"}));
    FileReader again(folder / "a");
    again.read_line(line, 100);
    again.read_line(line, 100);
    expect_error<InputError>([&] { again.read_line(line, 5); }, {"longer than 5"});
}

TEST(FileReader, RefusesWhatIsNoFile) {
    TempFolder folder;
    expect_error<InputError>([&] { FileReader reader(folder / "none"); }, {"none", "No such file"});
    expect_error<InputError>([&] { FileReader reader(folder.path()); }, {"not a regular file"});
}

TEST(FileReader, ChecksClaimsWithoutOverflow) {
    TempFolder folder;
    FileReader reader(folder.write("a", std::string(100, 'x')));
    EXPECT_NO_THROW(reader.require_room(10, 10, "things"));
    expect_error<InputError>([&] { reader.require_room(11, 10, "things"); }, {"11 things", "100 bytes"});
    expect_error<InputError>([&] { reader.require_room(~uint64_t(0) / 4 + 1, 4, "things"); }, {"things"});
    expect_error<InputError>([&] { reader.skip(~uint64_t(0), "things"); }, {"things"});
}

TEST(Text, ParsesNumbers) {
    EXPECT_EQ(core::parse_number("1.5"), 1.5);
    EXPECT_EQ(core::parse_number("+2e3"), 2000);
    EXPECT_EQ(core::parse_number("1e-999"), 0);
    EXPECT_EQ(core::parse_number("-1e999"), -INFINITY);
    EXPECT_TRUE(std::isnan(core::parse_number("nan").value()));
    for (const char* wrong : {"", "x", "1.5x", "1,5", "+-1", "--1"})
        EXPECT_FALSE(core::parse_number(wrong)) << wrong;
    EXPECT_EQ(core::parse_integer<uint8_t>("255"), 255);
    for (const char* wrong : {"256", "-1", "", "1.0", "7 "})
        EXPECT_FALSE(core::parse_integer<uint8_t>(wrong)) << wrong;
}

TEST(FileReader, SkipsAByteOrderMark) {
    const TempFolder folder;
    const std::string mark = "\xef\xbb\xbf";
    const auto path = folder.write("a.txt", mark + "one\n" + mark + "two\n");
    core::FileReader reader(path);
    std::string line;
    EXPECT_TRUE(reader.read_line(line, 10));
    EXPECT_EQ(line, "one");
    EXPECT_TRUE(reader.read_line(line, 10));
    EXPECT_EQ(line, mark + "two");
    EXPECT_EQ(core::read_text_file(path), "one\n" + mark + "two\n");
    EXPECT_EQ(core::read_text_file(folder.write("short", "\xef\xbb")), "\xef\xbb");
}

}  // namespace
