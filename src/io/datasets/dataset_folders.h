// SPDX-License-Identifier: Apache-2.0
// Which folders are datasets, and the rule that outputs never land among photos.
#pragma once
#include <filesystem>
#include <string>

#include "ewa/dataset.h"

namespace ewa::io {

/// Whether load_dataset finds cameras in the folder. below false: in its usual places alone, and not elsewhere below it.
bool is_dataset_folder(const std::filesystem::path& folder, bool below = true);

/// For a command that names the files in its output folder itself. Throws InputError if the folder is a dataset, or one of
/// a dataset's folders of images, masks or cameras. option: how the user names the folder.
void check_output_folder(const std::string& option, const std::filesystem::path& folder);
/// Also if the folder holds an image or mask of this dataset.
void check_output_folder(const std::string& option, const std::filesystem::path& folder,
                         const Dataset& dataset);
/// Only for a folder inside a dataset: the command may write datasets.
void check_not_inside_dataset(const std::string& option, const std::filesystem::path& folder);

}  // namespace ewa::io
