// SPDX-License-Identifier: Apache-2.0
// What the headless program is linked to: no window library, by itself.
#include <elf.h>
#include <gtest/gtest.h>

#include <cstring>
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

/// The libraries that a program names itself (DT_NEEDED), as its dynamic section has them.
std::vector<std::string> needed_by(const std::string& path) {
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
            if (entry.d_tag == DT_NEEDED) names.emplace_back(&bytes.at(strings.sh_offset + entry.d_un.d_val));
        }
    }
    return names;
}

/// Whether one begins so.
bool any(const std::vector<std::string>& names, const std::string& start) {
    for (const std::string& name : names)
        if (name.starts_with(start)) return true;
    return false;
}

constexpr const char* kWindowLibraries[] = {"libX11", "libxcb", "libglfw", "libwayland", "libGL", "libimgui"};

/// Direct links alone: Debian's OpenImageIO brings FFmpeg's libavutil, and that libX11.
TEST(Links, TheHeadlessProgramKnowsNoWindow) {
    const auto names = needed_by(EWA_PROGRAM);
    for (const char* library : kWindowLibraries)
        EXPECT_FALSE(any(names, library)) << library << " is linked directly";
    EXPECT_TRUE(any(names, "libvulkan")) << "this reads something else";
}

#ifdef EWA_VIEW_PROGRAM
/// What the test above looks for is there to be found.
TEST(Links, TheViewerHasAWindow) {
    EXPECT_TRUE(any(needed_by(EWA_VIEW_PROGRAM), "libglfw"));
}
#endif

}  // namespace
}  // namespace ewa::test
