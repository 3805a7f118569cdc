// SPDX-License-Identifier: Apache-2.0
// The names of a dataset and of its frames, as people type them.
#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "ewa/dataset.h"

namespace ewa::scene {

/// The indices of a list of frames, in the order of the list and each once. Commas separate its items: an index in name order from
/// 0, a range of two indices such as 3-7, or the name of a frame ("0001.jpg"). A name may lack folder and extension if it then
/// still fits only one frame. If an item can be a name or a range, it is a name. Throws InputError.
std::vector<int> frames_named(const Dataset& dataset, const std::string& list);

/// The index of this name, or -1. A name without its folder or extension is found if it fits one name only.
int index_of_name(const std::vector<std::string>& names, const std::string& name);

/// The name of a dataset: that of its folder. For a file, and for a COLMAP model (sparse, or sparse/0): the folder that it belongs
/// to. "dataset" if there is no name.
std::string dataset_name(const std::filesystem::path& path);

}  // namespace ewa::scene
