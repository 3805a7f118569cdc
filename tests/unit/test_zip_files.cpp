// SPDX-License-Identifier: Apache-2.0
// Zip archives from strangers: what is unpacked, and what is refused before anything is written.
#include "io/datasets/zip_files.h"

#include <filesystem>
#include <initializer_list>
#include <string>
#include <vector>

#include "io/splats/archive.h"
#include "support/temp_folder.h"

namespace {

using namespace ewa;
using io::ZipFiles;
using Entries = std::vector<std::pair<std::string, std::string>>;

std::string zip_of(const Entries& entries) {
    io::ArchiveWriter writer;
    for (const auto& [name, bytes] : entries) writer.add(name, bytes);
    return writer.finish();
}

/// Overwrites bytes of the directory's record of the first entry.
std::string with_directory_bytes(std::string zip, size_t offset, const std::string& bytes) {
    return zip.replace(zip.find("PK\1\2") + offset, bytes.size(), bytes);
}

/// What is wrong with an archive.
void refuse_zip(const std::string& bytes, std::initializer_list<std::string> texts) {
    const test::TempFolder folder;
    folder.write("a.zip", bytes);
    test::expect_error<InputError>([&] { io::check_zip(folder / "a.zip"); }, texts);
}

TEST(ZipFiles, AreUnpackedWithTheirFolders) {
    const test::TempFolder folder;
    folder.write("a.zip", zip_of({{"top/", ""},
                                  {"top/images/a.png", "one"},
                                  {"top\\b.txt", std::string(600000, 'x')},
                                  {"__MACOSX/top/._a.png", "no"},
                                  {"top/.DS_Store", "no"},
                                  {"top/capture.json", "no"}}));
    EXPECT_TRUE(io::is_zip(folder / "a.zip"));
    const ZipFiles zip(folder / "a.zip");
    EXPECT_EQ(zip.bytes(), 600003u);
    int calls = 0;
    EXPECT_TRUE(zip.unpack(folder / "to", [&](int done) { return done == ++calls; }));
    EXPECT_EQ(calls, 2);
    EXPECT_EQ(test::file_bytes(folder / "to/top/images/a.png"), "one");
    EXPECT_EQ(test::file_bytes(folder / "to/top/b.txt"), std::string(600000, 'x'));
    EXPECT_FALSE(std::filesystem::exists(folder / "to/top/capture.json"));
    EXPECT_FALSE(zip.unpack(folder / "stopped", [](int) { return false; }));
    folder.write("b.zip", "no archive");
    EXPECT_FALSE(io::is_zip(folder / "b.zip"));
}

TEST(ZipFiles, NamesStayInTheFolder) {
    for (const char* name : {"../a", "/etc/a", "a/../../b", "C:\\a", "..\\a"})
        refuse_zip(zip_of({{"good", "x"}, {name, "x"}}), {"a.zip: \"", "leads out of the folder"});
    refuse_zip(zip_of({{"a\nb", "x"}}), {"control character"});
    refuse_zip(zip_of({{std::string(300, 'a'), "x"}}), {"is too long"});
    refuse_zip(zip_of({{"a", "x"}, {"a", "y"}}), {"\"a\" is there twice"});
    refuse_zip(zip_of({{"a", "x"}, {"a/b", "y"}}), {"\"a\" is both a file and a folder"});
    const std::string link = std::string("\0\0\xff\xa1", 4);  // mode 120777
    refuse_zip(with_directory_bytes(zip_of({{"a", "/etc/passwd"}}), 38, link), {"\"a\" is a link"});
}

TEST(ZipFiles, BombsAreRefusedUnread) {
    const std::string zip = zip_of({{"a", "x"}});
    const std::string huge = "\xff\xff\xff\x7f", some = std::string("\0\0\1\0", 4);
    refuse_zip(with_directory_bytes(zip, 24, huge), {"a.zip: claims to unpack from", "2.15 GB"});
    refuse_zip(with_directory_bytes(zip, 20, some), {"\"a\" claims bytes that the archive does not have"});
    refuse_zip(with_directory_bytes(zip, 8, "\1"), {"\"a\" is encrypted"});
    refuse_zip(with_directory_bytes(zip, 10, "\x0c"), {"packed with method 12"});
}

TEST(ZipFiles, DamageIsAnError) {
    const std::string zip = zip_of({{"a", "some bytes"}, {"b", "more"}});
    std::string changed = zip;
    changed[changed.find("some")] = 'S';
    refuse_zip(changed, {"\"a\" is damaged or cut off"});
    // The last bytes are those of a comment, and zeros.
    for (size_t size = 0; size + 4 < zip.size(); ++size) refuse_zip(zip.substr(0, size), {"a.zip"});
    refuse_zip("PK\5\6" + std::string(18, '\0'), {"not a zip archive, or its directory at byte 22"});
}

}  // namespace
