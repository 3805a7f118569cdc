// SPDX-License-Identifier: Apache-2.0
// Which folders are datasets, and the rule that outputs never land among photos.
#pragma once
#include <filesystem>
#include <string>

#include "ewa/dataset.h"

namespace ewa::io {

/// Whether load_dataset() finds cameras in the folder. below: also search all folders below it; else only the usual places.
bool is_dataset_folder(const std::filesystem::path& folder, bool below = true);

/// Checks the output folder of a command that chooses file names itself. Throws InputError if the folder is a dataset, or one
/// of a dataset's folders of images, masks or cameras. option: the option or argument that names the folder.
void check_output_folder(const std::string& option, const std::filesystem::path& folder);
/// As above. Throws InputError also if the folder holds an image or mask of this dataset.
void check_output_folder(const std::string& option, const std::filesystem::path& folder,
                         const Dataset& dataset);
/// Checks the output folder of a command that may write datasets. Throws InputError only for a folder inside a dataset.
void check_not_inside_dataset(const std::string& option, const std::filesystem::path& folder);

}  // namespace ewa::io
