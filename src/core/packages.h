// SPDX-License-Identifier: Apache-2.0
// What to install on this system for what ewa lacks. docs/install.md has the same table.
#pragma once
#include <string>
#include <string_view>

namespace ewa::core {

enum class Thing {
    driver,  // of Vulkan
    validation,
    ffmpeg,
    colmap,
    openimageio,
    openvdb,
    mpi,
    file_dialog,
    opener,  // of files, in the desktop's programs
    heif,
    raw,  // photos as the sensor has them
    count
};

/// Systems with the same packages. Derivatives count as the system that they come from.
enum class Family { debian, fedora, rhel, suse, arch, alpine, nixos, windows, other, count };

/// The family of a system with this text in its file os-release.
Family family_of(std::string_view os_release);

/// What gets the thing on this system, for messages: "apt install ffmpeg".
std::string how_to_install(Thing thing);
std::string how_to_install(Thing thing, Family family);

/// As how_to_install(), for a library that one of ewa's modules links: "install ewa's module and OpenVDB (apt install libopenvdb-dev)".
std::string how_to_install_module(Thing library);
std::string how_to_install_module(Thing library, Family family);

}  // namespace ewa::core
