// SPDX-License-Identifier: Apache-2.0
#include "core/packages.h"

#include "core/text.h"
#include "platform/system.h"

namespace ewa::core {
namespace {

/// What a package of each family needs before its name.
constexpr const char* kInstall[] = {"apt install ",    "dnf install ",    "dnf install ",
                                    "zypper install ", "pacman -S ",      "apk add ",
                                    "nix-shell -p ",   "winget install ", "install "};
static_assert(std::size(kInstall) == size_t(Family::count));

/// A cell is a name of packages, or after = a whole remedy. Null: the family has no package, or its name is not known; then the
/// last cell counts, which is of any system.
struct Row {
    const char* cells[size_t(Family::count)];
    const char* also = "";  // follows packages
};

// In the order of Thing.
constexpr Row kRows[] = {
    {{"mesa-vulkan-drivers", "mesa-vulkan-drivers vulkan-loader", "mesa-vulkan-drivers vulkan-loader",
      "libvulkan_lvp libvulkan1", "vulkan-swrast vulkan-icd-loader", "mesa-vulkan-swrast vulkan-loader",
      "=set hardware.graphics.enable = true", "=install the driver of your GPU's vendor",
      "Mesa's Vulkan driver lavapipe"},
     ", or the driver of your GPU's vendor"},
    {{"vulkan-validationlayers", "vulkan-validation-layers", "vulkan-validation-layers",
      "vulkan-validationlayers", "vulkan-validation-layers", "vulkan-validation-layers",
      "vulkan-validation-layers", "KhronosGroup.VulkanSDK", "Khronos's validation layer"}},
    {{"ffmpeg", "ffmpeg-free", "=install ffmpeg-free of EPEL", "ffmpeg", "ffmpeg", "ffmpeg", "ffmpeg",
      "Gyan.FFmpeg", "ffmpeg"}},
    {{"colmap", nullptr, nullptr, nullptr, nullptr, "=build COLMAP", "colmap",
      "=pip install pycolmap, or put the folder bin of COLMAP into PATH", "=pip install pycolmap"},
     ", or pip install pycolmap"},
    {{"libopenimageio-dev", "OpenImageIO", nullptr, "OpenImageIO-devel", "openimageio", "openimageio",
      "openimageio", "=unpack the whole archive of ewa", "OpenImageIO"}},
    {{"libopenvdb-dev", "openvdb-libs", nullptr, "openvdb-devel", "openvdb", "openvdb", "openvdb",
      "=unpack the whole archive of ewa", "OpenVDB"}},
    {{"openmpi-bin", "openmpi", "openmpi", "openmpi4", "openmpi", "openmpi", "openmpi", "=take ewa on Linux",
      "Open MPI"}},
    {{"zenity", "zenity", "zenity", "zenity", "zenity", "zenity", "zenity", nullptr, "zenity"}},
    {{"xdg-utils", "xdg-utils", "xdg-utils", "xdg-utils", "xdg-utils", "xdg-utils", "xdg-utils", nullptr,
      "xdg-utils"}},
    {{"libheif-examples", "libheif-tools, and libheif-freeworld of RPM Fusion", nullptr, nullptr, "libheif",
      "libheif-tools", "libheif", "ImageMagick.ImageMagick", "libheif's programs"}},
    {{"darktable", "darktable", nullptr, "darktable", "darktable", "darktable", "darktable",
      "darktable.darktable", "darktable"}}};
static_assert(std::size(kRows) == size_t(Thing::count));

Family family_of_word(std::string_view id) {
    constexpr std::pair<std::string_view, Family> kWords[] = {
        {"debian", Family::debian}, {"ubuntu", Family::debian}, {"fedora", Family::fedora},
        {"rhel", Family::rhel},     {"centos", Family::rhel},   {"suse", Family::suse},
        {"opensuse", Family::suse}, {"sles", Family::suse},     {"arch", Family::arch},
        {"alpine", Family::alpine}, {"nixos", Family::nixos},   {"windows", Family::windows}};
    for (const auto& [word, family] : kWords)
        if (id == word) return family;
    return Family::other;
}

/// The value of a variable of os-release, without its quotes.
std::string_view value_of(std::string_view text, std::string_view name) {
    std::string_view value;
    while (!text.empty()) {
        std::string_view line = text.substr(0, text.find('\n'));
        text.remove_prefix(std::min(line.size() + 1, text.size()));
        if (!line.starts_with(name) || line.substr(name.size(), 1) != "=") continue;
        value = trim(line.substr(name.size() + 1));
        for (const char quote : {'"', '\''})
            if (value.size() >= 2 && value.front() == quote && value.back() == quote)
                value = value.substr(1, value.size() - 2);
    }
    return value;  // the last one counts, as in a shell
}

Family own_family() {
    static const Family family = family_of(platform::system_release());
    return family;
}

}  // namespace

Family family_of(std::string_view os_release) {
    // The nearest relative comes first.
    for (const char* name : {"ID", "ID_LIKE"}) {
        std::string_view ids = value_of(os_release, name);
        while (!(ids = trim(ids)).empty())
            if (const Family family = family_of_word(next_word(ids)); family != Family::other) return family;
    }
    return Family::other;
}

std::string how_to_install(Thing thing, Family family) {
    const Row& row = kRows[size_t(thing)];
    if (!row.cells[size_t(family)]) family = Family::other;
    const std::string cell = row.cells[size_t(family)];
    return cell.starts_with('=') ? cell.substr(1) : kInstall[size_t(family)] + cell + row.also;
}

std::string how_to_install(Thing thing) {
    return how_to_install(thing, own_family());
}

std::string how_to_install_module(Thing library, Family family) {
    const std::string how = how_to_install(library, family);
    if (family == Family::windows) return how;
    const std::string name = kRows[size_t(library)].cells[size_t(Family::other)];
    const std::string both = "install ewa's module and " + name;
    return how == "install " + name ? both : both + " (" + how + ")";
}

std::string how_to_install_module(Thing library) {
    return how_to_install_module(library, own_family());
}

}  // namespace ewa::core
