// SPDX-License-Identifier: Apache-2.0
// Finds photos and videos at a path, and explains what a path is that has none.
#pragma once
#include <filesystem>
#include <vector>

namespace ewa::capture {

/// The folder of an unpacked archive's content. This is `folder`, or its only subfolder that is a dataset with photos, or its only
/// subfolder that has cameras or photos.
std::filesystem::path main_folder(std::filesystem::path folder);

/// The folder that has the photos: `folder`, or its images/, or its photos/ or input/ if all are there.
std::filesystem::path folder_of_photos(const std::filesystem::path& folder);

/// The videos that a dataset is made of: the input itself, or the videos of a folder without photos. proxies: receives the skipped
/// small copies of videos; may be null.
std::vector<std::filesystem::path> videos_of(const std::filesystem::path& input,
                                             std::vector<std::filesystem::path>* proxies = nullptr);

/// Throws InputError for folders that ewa has written, whose images are not photos.
void refuse_made(const std::filesystem::path& input);

/// Throws InputError that says what the path is, instead of photos or videos. otherwise: the text if the kind is not known.
[[noreturn]] void refuse(const std::filesystem::path& path, const char* otherwise);

}  // namespace ewa::capture
