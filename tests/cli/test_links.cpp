// SPDX-License-Identifier: Apache-2.0
// What the programs bring with them at the start: the headless one no window library, none OpenImageIO.
#include <elf.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "cli/program.h"

namespace ewa::test {
namespace {

template <class Value>
Value value_at(const std::string& bytes, uint64_t offset) {
    Value value;
    if (offset > bytes.size() || bytes.size() - offset < sizeof(value))
        throw std::runtime_error("a short ELF file");
    std::memcpy(&value, bytes.data() + offset, sizeof(value));
    return value;
}

/// The words of an ELF file's dynamic section under these tags.
std::vector<std::string> dynamic_words(const std::string& path, const std::vector<Elf64_Sxword>& tags) {
    const std::string bytes = read_file(path);
    const auto header = value_at<Elf64_Ehdr>(bytes, 0);
    if (std::memcmp(header.e_ident, ELFMAG, SELFMAG) != 0 || header.e_ident[EI_CLASS] != ELFCLASS64)
        throw std::runtime_error(path + " is no ELF file of 64 bits");
    std::vector<std::string> names;
    for (uint64_t i = 0; i < header.e_shnum; ++i) {
        const auto section = value_at<Elf64_Shdr>(bytes, header.e_shoff + i * header.e_shentsize);
        if (section.sh_type != SHT_DYNAMIC) continue;
        const auto strings =
            value_at<Elf64_Shdr>(bytes, header.e_shoff + uint64_t(section.sh_link) * header.e_shentsize);
        for (uint64_t at = 0; at + sizeof(Elf64_Dyn) <= section.sh_size; at += sizeof(Elf64_Dyn)) {
            const auto entry = value_at<Elf64_Dyn>(bytes, section.sh_offset + at);
            if (std::ranges::find(tags, entry.d_tag) != tags.end())
                names.emplace_back(&bytes.at(strings.sh_offset + entry.d_un.d_val));
        }
    }
    return names;
}

/// The libraries that a program names itself.
std::vector<std::string> needed_by(const std::string& path) {
    return dynamic_words(path, {DT_NEEDED});
}

/// Whether one begins so.
bool any(const std::vector<std::string>& names, const std::string& start) {
    for (const std::string& name : names)
        if (name.starts_with(start)) return true;
    return false;
}

constexpr const char* kWindowLibraries[] = {"libX11", "libxcb", "libglfw", "libwayland", "libGL", "libimgui"};

/// All libraries that are loaded before its first line, as the dynamic linker tells them.
std::vector<std::string> loaded_by(const std::string& path) {
    Circumstances circumstances;
    circumstances.program = path;
    circumstances.environment = {{"LD_TRACE_LOADED_OBJECTS", "1"}};
    std::istringstream lines(run_ewa({}, circumstances).out);
    std::vector<std::string> names;
    for (std::string line, name; std::getline(lines, line);)
        if (std::istringstream(line) >> name) names.push_back(name);
    return names;
}

TEST(Links, TheHeadlessProgramKnowsNoWindow) {
    const auto names = loaded_by(EWA_PROGRAM);
    for (const char* library : kWindowLibraries) EXPECT_FALSE(any(names, library)) << library << " is loaded";
    EXPECT_FALSE(any(names, "libvulkan")) << "files need no loader";
    EXPECT_TRUE(any(names, "libpng")) << "this reads something else";
}

/// It and the two hundred libraries behind it would be most of the time that a short command takes.
TEST(Links, OpenImageIOIsNotLoadedAtTheStart) {
    const auto names = loaded_by(EWA_PROGRAM);
    EXPECT_FALSE(any(names, "libOpenImageIO"));
    EXPECT_FALSE(any(names, "libvulkan")) << "files need no loader";
    EXPECT_TRUE(any(names, "libpng")) << "this reads something else";
    EXPECT_LT(names.size(), 30u);
#ifdef EWA_VIEW_PROGRAM
    const auto of_the_viewer = loaded_by(EWA_VIEW_PROGRAM);
    EXPECT_FALSE(any(of_the_viewer, "libOpenImageIO"));
    EXPECT_TRUE(any(of_the_viewer, "libpng")) << "this reads something else";
#endif
    EXPECT_TRUE(any(needed_by(EWA_OPENIMAGEIO_MODULE), "libOpenImageIO")) << "this reads something else";
}

/// No run paths: CMake ends those of a build tree in an empty entry, which is the folder one happens to be
/// in, and a stranger's scene could bring its own Vulkan.
TEST(Links, LibrariesAreLookedForWhereTheSystemHasThem) {
    std::vector<std::string> files = {EWA_PROGRAM, EWA_OPENIMAGEIO_MODULE};
#ifdef EWA_VIEW_PROGRAM
    files.push_back(EWA_VIEW_PROGRAM);
#endif
    for (const std::string& file : files)
        EXPECT_TRUE(dynamic_words(file, {DT_RUNPATH, DT_RPATH}).empty()) << file;
}

#ifdef EWA_VIEW_PROGRAM
/// What the first test looks for is there to be found.
TEST(Links, TheViewerHasAWindow) {
    EXPECT_TRUE(any(loaded_by(EWA_VIEW_PROGRAM), "libglfw"));
}
#endif

}  // namespace
}  // namespace ewa::test
