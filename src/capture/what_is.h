// SPDX-License-Identifier: Apache-2.0
// The kind of input that a path names. All commands, the window and the Python package use it.
#pragma once
#include <filesystem>
#include <string_view>

namespace ewa {

enum class What {
    nothing,  // there is no such path, or the folder is none of the others
    run,      // the folder of a training run, also of one that has just begun
    dataset,  // a folder or a file with cameras
    archive,  // a zip archive, of any of the others
    photos,   // a folder of photos without cameras
    video,    // a video, or a folder of videos without photos
    mesh,     // a glTF file, if it has no splats
    image,
    splats,  // any other file: the reader of splats says what is wrong with it
};

/// The kind of the path. A folder that is a dataset and a run is a dataset. Throws InputError if it cannot be read.
What what_is(const std::filesystem::path& path);

/// Whether ewa has to search for cameras to make a dataset of this kind of input: photos, a video or an archive.
bool is_searched(What what);

/// The image format by the file's first bytes. Empty for other files, and for .splat, which may begin with any bytes.
/// Throws InputError.
std::string_view image_format(const std::filesystem::path& path);

}  // namespace ewa
