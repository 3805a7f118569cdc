// SPDX-License-Identifier: Apache-2.0
// Photos, videos and archives at a path, and what the path is instead.
#pragma once
#include <filesystem>
#include <vector>

namespace ewa::capture {

/// The folder in which an archive has everything: itself, or the only one in it that is a dataset with photos, or the only one
/// that has cameras or photos.
std::filesystem::path main_folder(std::filesystem::path folder);

/// The photos are in the folder, or in its images/, or all in its photos/ or input/.
std::filesystem::path folder_of_photos(const std::filesystem::path& folder);

/// The videos that a dataset is made of: the input itself, or those of a folder without photos. proxies: get those that are
/// skipped.
std::vector<std::filesystem::path> videos_of(const std::filesystem::path& input,
                                             std::vector<std::filesystem::path>* proxies = nullptr);

/// Throws InputError for what ewa itself has made, whose pictures are no photos.
void refuse_made(const std::filesystem::path& input);

/// Throws what the path is instead of an input; `otherwise` if nothing is known.
[[noreturn]] void refuse(const std::filesystem::path& path, const char* otherwise);

}  // namespace ewa::capture
