// SPDX-License-Identifier: Apache-2.0
// Zip archives from strangers: what is unpacked, and what is refused before anything is written.
#include "io/splats/zip_files.h"

#include <ctime>
#include <filesystem>
#include <initializer_list>
#include <string>
#include <vector>

#include "ewa/splat_files.h"
#include "io/splats/archive.h"
#include "io/splats/zipped_splats.h"
#include "support/splat_scenes.h"
#include "support/temp_folder.h"
#include "support/zip_bytes.h"

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
    refuse_zip(zip_of({{"a", "x"}, {"a.b", "y"}, {"a/b/c", "z"}}), {"\"a\" is both a file and a folder"});
    std::string deep;
    for (int i = 0; i < 65; ++i) deep += "a/";
    refuse_zip(zip_of({{deep + "b", "x"}}), {"is more than 64 folders deep"});
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

TEST(ZipFiles, ManyDeepEntriesAreCheckedInTime) {
    const test::TempFolder folder;
    std::string deep;
    for (int i = 0; i < 60; ++i) deep += "abcdefgh/";
    io::ArchiveWriter writer;
    for (int i = 0; i < 20000; ++i) writer.add(deep + std::to_string(i), "");
    folder.write("a.zip", writer.finish());
    const std::clock_t begin = std::clock();
    EXPECT_EQ(io::check_zip(folder / "a.zip"), 0u);
    EXPECT_LT(double(std::clock() - begin) / CLOCKS_PER_SEC, 20);  // of the processor
}

/// Splats of a file, as its bytes.
std::string splat_bytes(const test::TempFolder& folder, const std::string& name) {
    save_splats(folder / name, test::storable_splats(1, 12, 0));
    return test::file_bytes(folder / name);
}

TEST(ZippedSplats, OneFileIsReadWhateverIsBesideIt) {
    const test::TempFolder folder;
    const std::string mesh =
        "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\n"
        "property float z\nend_header\n1 2 3\n";
    for (const char* name : {"a.ply", "a.compressed.ply", "a.spz", "a.splat", "a.sog", "a.glb"})
        for (const std::string top : {"", "scan/", "scan/0/"}) {
            SCOPED_TRACE(top + name);
            const std::string bytes = splat_bytes(folder, name);
            folder.write("b.zip", test::zipped({{.name = top + "README.txt", .content = "read me"},
                                                {.name = "LICENSE", .content = "free"},
                                                {.name = "__MACOSX/" + top + "._" + name, .content = "no"},
                                                {.name = top + "points.ply", .content = mesh},
                                                {.name = top + name, .content = bytes, .method = 8}}));
            EXPECT_TRUE(io::has_splats(ZipFiles(folder / "b.zip")));
            const SplatScene scene = read_splats(folder / "b.zip");
            EXPECT_EQ(scene.gaussians.means, read_splats(folder / name).gaussians.means);
            EXPECT_EQ(scene.format, format_of_file(folder / "b.zip"));
            EXPECT_EQ(scene.format, format_of_name(name));
            EXPECT_TRUE(scene.variant.ends_with("zipped")) << scene.variant;
        }
}

TEST(ZippedSplats, FormatsOfSeveralFilesAreReadInTheirFolder) {
    const test::TempFolder folder;
    const Gaussians g = test::storable_splats(1, 12, 1);
    for (const char* name : {"meta.json", "a.gltf"}) {
        const test::TempFolder parts;
        save_splats(parts / name, g);
        for (const std::string top : {"scan/", "a/b/"}) {
            std::vector<test::ZipEntry> entries = {{.name = "notes.md", .content = "x"}};
            for (const auto& file : std::filesystem::directory_iterator(parts.path()))
                entries.push_back({top + file.path().filename().string(), test::file_bytes(file.path())});
            folder.write("a.zip", test::zipped(entries));
            EXPECT_EQ(read_splats(folder / "a.zip").gaussians.means,
                      read_splats(parts / name).gaussians.means);
        }
    }
}

TEST(ZippedSplats, OthersAreRefusedWithTheWayOut) {
    const test::TempFolder folder;
    const auto refuse = [&](const std::vector<test::ZipEntry>& entries,
                            std::initializer_list<std::string> parts) {
        folder.write("a.zip", test::zipped(entries));
        test::expect_error<InputError>([&] { read_splats(folder / "a.zip"); }, parts);
    };
    const std::string bytes = splat_bytes(folder, "a.ply");
    refuse({{"a.txt", "x"}}, {"a.zip: an archive without splats", "unpack"});
    refuse({{"a.zip", "PK"}}, {"unpack"});
    refuse({{"7000/a.ply", bytes}, {"30000/a.ply", bytes}}, {"7000/a.ply and 30000/a.ply", "unpack it"});
    refuse({{"lod-meta.json", "{}"}, {"0_0/meta.json", "\"means\""}}, {"streamed SOG", "unpack"});
    refuse({{"b/a.ply", bytes.substr(0, bytes.size() - 3)}}, {"a.zip: b/a.ply: byte"});
    EXPECT_FALSE(
        io::has_splats((folder.write("b.zip", test::zipped({{"a.jpg", "x"}})), ZipFiles(folder / "b.zip"))));
}

}  // namespace
