// SPDX-License-Identifier: Apache-2.0
#include "image/pictures_below.h"

#include <algorithm>
#include <set>
#include <string>

#include "core/text.h"
#include "ewa/error.h"
#include "image/openimageio.h"

namespace ewa::image {
namespace {

namespace fs = std::filesystem;

/// Extensions in small letters. Films and texts that OpenImageIO draws are no pictures to compare.
std::set<std::string> picture_extensions() {
    std::set<std::string> extensions;
    for (const auto& [format, names] : openimageio().extensions())
        if (format != "ffmpeg" && format != "null" && format != "term" && format != "ptex")
            extensions.insert(names.begin(), names.end());
    return extensions;
}

}  // namespace

std::vector<fs::path> pictures_below(const fs::path& folder) try {
    const std::set<std::string> extensions = picture_extensions();
    std::vector<fs::path> found;
    for (const fs::directory_entry& entry : fs::recursive_directory_iterator(folder)) {
        std::string extension = core::lower(entry.path().extension().string());
        if (extension.empty() || !entry.is_regular_file()) continue;
        if (extensions.count(extension.substr(1))) found.push_back(fs::relative(entry.path(), folder));
    }
    std::sort(found.begin(), found.end());
    return found;
} catch (const fs::filesystem_error& error) {
    throw InputError(
        core::one_line(folder.string() + ": the folder cannot be read: " + error.code().message()));
}

}  // namespace ewa::image
