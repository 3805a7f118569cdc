// SPDX-License-Identifier: Apache-2.0
// Sandboxed paths: names inside untrusted files may only refer to files in or below their own folder.
#pragma once
#include <filesystem>
#include <optional>
#include <string_view>

namespace ewa::core {

/// The normalised name with / between its parts. Empty if the name is empty, absolute or that of a folder. Also empty if it has a
/// drive or a zero byte, or leaves the starting folder.
std::optional<std::filesystem::path> name_inside(std::string_view name);

/// Whether this name (from name_inside) is still below the folder after links are followed. The folder itself
/// may be a link. A missing file counts by the path that it would have.
bool links_stay_inside(const std::filesystem::path& folder, const std::filesystem::path& name);

/// Advice for errors about links that lead out.
inline constexpr const char* kLinkAdvice =
    "copy the files that it refers to (cp -rL), or make the whole folder of the images a link";

/// As links_stay_inside(), for images of a dataset. The first part of the name, their folder, may be a link to anywhere.
/// Links below this folder must not lead out of the dataset or of the folder.
bool links_stay_with_images(const std::filesystem::path& folder, const std::filesystem::path& name);

}  // namespace ewa::core
