// SPDX-License-Identifier: Apache-2.0
// What to install, by the system's file os-release; and the same table in docs/install.md.
#include <algorithm>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "core/packages.h"
#include "platform/system.h"

namespace {

using namespace ewa::core;

// As the systems ship them.
constexpr const char *kDebian = R"os(PRETTY_NAME="Debian GNU/Linux 12 (bookworm)"
NAME="Debian GNU/Linux"
VERSION_ID="12"
VERSION_CODENAME=bookworm
ID=debian
HOME_URL="https://www.debian.org/"
)os",
                     *kUbuntu = R"os(NAME="Ubuntu"
VERSION_ID="24.04"
UBUNTU_CODENAME=noble
ID=ubuntu
ID_LIKE=debian
)os",
                     *kMint = R"os(NAME="Linux Mint"
ID=linuxmint
ID_LIKE="ubuntu debian"
)os",
                     *kFedora = R"os(NAME="Fedora Linux"
VERSION="41 (Workstation Edition)"
ID=fedora
VERSION_ID=41
PLATFORM_ID="platform:f41"
VARIANT_ID=workstation
)os",
                     *kRocky = R"os(NAME="Rocky Linux"
VERSION="9.5 (Blue Onyx)"
ID="rocky"
ID_LIKE="rhel centos fedora"
VERSION_ID="9.5"
PLATFORM_ID="platform:el9"
)os",
                     *kTumbleweed = R"os(NAME="openSUSE Tumbleweed"
# VERSION="20241201"
ID="opensuse-tumbleweed"
ID_LIKE="opensuse suse"
)os",
                     *kArch = R"os(NAME="Arch Linux"
ID=arch
BUILD_ID=rolling
)os",
                     *kManjaro = R"os(NAME="Manjaro Linux"
ID=manjaro
ID_LIKE=arch
)os",
                     *kAlpine = R"os(NAME="Alpine Linux"
ID=alpine
VERSION_ID=3.21.0
)os",
                     *kNixos = R"os(ANSI_COLOR="1;34"
ID=nixos
IMAGE_ID=""
)os";

TEST(Packages, TheFamilyIsThatOfTheNearestRelative) {
    const std::pair<std::string, Family> cases[] = {
        {kDebian, Family::debian},
        {kUbuntu, Family::debian},
        {kMint, Family::debian},
        {kFedora, Family::fedora},
        {kRocky, Family::rhel},
        {kTumbleweed, Family::suse},
        {kArch, Family::arch},
        {kManjaro, Family::arch},
        {kAlpine, Family::alpine},
        {kNixos, Family::nixos},
        {"ID=windows", Family::windows},
        {"ID_LIKE=\"strange arch\"\nID=own\n", Family::arch},
        {"ID='debian'\r\n", Family::debian},
        {"ID=void\nID=alpine\n", Family::alpine},  // the last one counts
        {"ID=debian\nID_LIKE=fedora\n", Family::debian}};
    for (const auto& [text, family] : cases) EXPECT_EQ(family_of(text), family) << text;
}

TEST(Packages, OtherTextsNameNoFamily) {
    for (const std::string& text :
         {std::string(), std::string("\n\n\n"), std::string("ID"), std::string("ID="), std::string("ID=\""),
          std::string("ID=\"\"\nID_LIKE=\"  \""), std::string("ID='debian\""),
          std::string("VERSION_ID=debian"), std::string("NAME=debian"), std::string(" ID=debian"),
          std::string("ID=debianoid"), std::string("#ID=debian"), std::string("\0ID=debian\0", 11),
          std::string(1 << 20, 'I'), "ID_LIKE=\"" + std::string(1 << 20, 'x') + "\"",
          std::string("ID=void\nID_LIKE=slackware\n")})
        EXPECT_EQ(family_of(text), Family::other) << text.substr(0, 80);
    EXPECT_EQ(family_of("ID=\"" + std::string(1 << 20, 'x') + " fedora\""), Family::fedora);
}

TEST(Packages, CommandsAreThoseOfTheSystem) {
    EXPECT_EQ(how_to_install(Thing::ffmpeg, family_of(kDebian)), "apt install ffmpeg");
    EXPECT_EQ(how_to_install(Thing::ffmpeg, family_of(kFedora)), "dnf install ffmpeg-free");
    EXPECT_EQ(how_to_install(Thing::ffmpeg, family_of(kRocky)), "install ffmpeg-free of EPEL");
    EXPECT_EQ(how_to_install(Thing::opener, family_of(kTumbleweed)), "zypper install xdg-utils");
    EXPECT_EQ(how_to_install(Thing::mpi, family_of(kManjaro)), "pacman -S openmpi");
    EXPECT_EQ(how_to_install(Thing::openvdb, family_of(kAlpine)), "apk add openvdb");
    EXPECT_EQ(how_to_install(Thing::raw, Family::nixos), "nix-shell -p darktable");
    EXPECT_EQ(how_to_install(Thing::raw, Family::windows), "winget install darktable.darktable");
    EXPECT_EQ(how_to_install(Thing::raw, Family::other), "install darktable");
    EXPECT_EQ(how_to_install(Thing::raw, Family::rhel), "install darktable");
    EXPECT_EQ(how_to_install(Thing::colmap, Family::debian), "apt install colmap, or pip install pycolmap");
    EXPECT_EQ(how_to_install(Thing::colmap, Family::fedora), "pip install pycolmap");
    EXPECT_EQ(how_to_install(Thing::driver, Family::debian),
              "apt install mesa-vulkan-drivers, or the driver of your GPU's vendor");
    EXPECT_EQ(how_to_install(Thing::driver, Family::windows), "install the driver of your GPU's vendor");
    const Family own = family_of(ewa::platform::system_release());
    EXPECT_EQ(how_to_install(Thing::raw), how_to_install(Thing::raw, own));
}

TEST(Packages, ALibraryIsNamedWithItsModule) {
    EXPECT_EQ(how_to_install_module(Thing::openvdb, Family::debian),
              "install ewa's module and OpenVDB (apt install libopenvdb-dev)");
    EXPECT_EQ(how_to_install_module(Thing::openimageio, Family::rhel),
              "install ewa's module and OpenImageIO");
    EXPECT_EQ(how_to_install_module(Thing::openimageio, Family::windows), "unpack the whole archive of ewa");
}

/// The cells of a row of a Markdown table, without backticks.
std::vector<std::string> cells_of(std::string row) {
    std::erase(row, '`');
    std::vector<std::string> cells;
    std::istringstream text(row.substr(1));
    for (std::string cell; std::getline(text, cell, '|');) {
        const size_t begin = cell.find_first_not_of(' ');
        cells.push_back(
            begin == std::string::npos ? "" : cell.substr(begin, cell.find_last_not_of(' ') - begin + 1));
    }
    return cells;
}

TEST(Packages, AreThoseOfTheDocument) {
    std::ifstream file(EWA_SOURCE_DIR "/docs/install.md");
    std::vector<std::vector<std::string>> rows;
    for (std::string line; std::getline(file, line);)
        if (line.starts_with("| To get") || (!rows.empty() && line.starts_with("|")))
            rows.push_back(cells_of(line));
        else if (!rows.empty())
            break;
    constexpr size_t kFamilies = size_t(Family::other);  // without the last, of any system
    ASSERT_EQ(rows.size(), size_t(Thing::count) + 2);    // a header, and a line below it
    for (size_t thing = 0; thing < size_t(Thing::count); ++thing) {
        const std::vector<std::string>& cells = rows[thing + 2];
        ASSERT_EQ(cells.size(), kFamilies + 1) << cells[0];
        for (size_t family = 0; family < kFamilies; ++family) {
            const std::string how = how_to_install(Thing(thing), Family(family)), &cell = cells[family + 1];
            if (cell.empty())
                EXPECT_EQ(how, how_to_install(Thing(thing), Family::other)) << cells[0] << " " << family;
            else
                EXPECT_NE((" " + how + ",").find(" " + cell + ","), std::string::npos)
                    << cells[0] << ": " << how << ", and in the document " << cell;
        }
    }
}

}  // namespace
