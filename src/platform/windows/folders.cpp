// SPDX-License-Identifier: Apache-2.0
#include "platform/folders.h"

#include "platform/system.h"
#include "platform/windows/windows.h"
// After windows.h.
#include <initguid.h>
#include <knownfolders.h>
#include <objbase.h>
#include <shlobj.h>

namespace ewa::platform {
namespace {

std::filesystem::path known_folder(const KNOWNFOLDERID& id) {
    wchar_t* found = nullptr;
    std::filesystem::path folder;
    if (SHGetKnownFolderPath(id, KF_FLAG_DEFAULT, nullptr, &found) == S_OK) folder = found;
    CoTaskMemFree(found);
    return folder;
}

}  // namespace

std::filesystem::path home_folder() {
    return known_folder(FOLDERID_Profile);
}

std::filesystem::path settings_folder() {
    return known_folder(FOLDERID_RoamingAppData);
}

std::filesystem::path cache_folder() {
    return known_folder(FOLDERID_LocalAppData);
}

std::filesystem::path shader_cache_folder() {
    return variable("MESA_SHADER_CACHE_DIR");
}

std::vector<std::filesystem::path> font_folders() {
    return {known_folder(FOLDERID_LocalAppData) / "Microsoft" / "Windows" / "Fonts",
            known_folder(FOLDERID_Fonts)};
}

std::vector<std::filesystem::path> driver_folders() {
    return {};
}

}  // namespace ewa::platform
