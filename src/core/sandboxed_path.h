// SPDX-License-Identifier: Apache-2.0
// Files that other files name. Who wrote a model or a scene may be a stranger: what it names has to stand in
// its own folder or below it.
#pragma once
#include <filesystem>
#include <optional>
#include <string_view>

namespace ewa::core {

/// The name with / between its parts, without "." and with "a/.." taken away. Nothing where it is empty or a
/// folder's, absolute, has a drive or a zero byte, or would leave the folder that it starts from.
std::optional<std::filesystem::path> name_inside(std::string_view name);

/// Whether what stands under this name (as name_inside gives it) lies below the folder when links are
/// followed. The folder itself may be a link. What is not there lies where it would be.
bool links_stay_inside(const std::filesystem::path& folder, const std::filesystem::path& name);

/// What helps where links lead out.
inline constexpr const char* kLinkAdvice =
    "copy what it leads to (cp -rL), or make the whole folder of the pictures a link";

/// The same for pictures, whose folder in a dataset (the first part of the name, as "images") may be a link
/// to wherever the pictures are; links below that lead out of neither.
bool links_stay_with_pictures(const std::filesystem::path& folder, const std::filesystem::path& name);

}  // namespace ewa::core
