// SPDX-License-Identifier: Apache-2.0
// What the headless program is linked to: no window library, by itself.
#include <gtest/gtest.h>

#include <array>
#include <cstdio>
#include <string>

namespace ewa::test {
namespace {

std::string output_of(const std::string& command) {
    std::string text;
    std::array<char, 4096> part;
    FILE* pipe = popen(command.c_str(), "r");
    if (!pipe) return text;
    while (const size_t got = fread(part.data(), 1, part.size(), pipe)) text.append(part.data(), got);
    pclose(pipe);
    return text;
}

/// Direct links alone: Debian's OpenImageIO brings FFmpeg's libavutil, and that libX11.
TEST(Links, TheHeadlessProgramKnowsNoWindow) {
    const std::string dynamic = output_of(std::string("readelf -d '") + EWA_PROGRAM + "' 2> /dev/null");
    if (dynamic.find("NEEDED") == std::string::npos) GTEST_SKIP() << "there is no readelf (Debian: binutils)";
    for (const char* library : {"libX11", "libxcb", "libglfw", "libwayland", "libGL"})
        EXPECT_EQ(dynamic.find(library), std::string::npos) << library << " is linked directly:\n" << dynamic;
    EXPECT_NE(dynamic.find("libvulkan"), std::string::npos) << "readelf shows something else";
}

}  // namespace
}  // namespace ewa::test
