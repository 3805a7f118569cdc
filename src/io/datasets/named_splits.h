// SPDX-License-Identifier: Apache-2.0
// The split of a transforms.json by lists of names, as nerfstudio writes it.
#pragma once
#include <nlohmann/json_fwd.hpp>
#include <string>

#include "io/datasets/image_records.h"

namespace ewa::io {

/// Sets the images' splits by "train_filenames", "val_filenames" and "test_filenames", and adds a note. The images of the last two are
/// held out. Without train_filenames, all others train. With it, an image that no list names is held out, or is removed if there
/// is a list of held-out images. Without any list, nothing changes. top: the file. where: begins the errors. Throws InputError for
/// lists that are none of names, that name no image at all, or that name one of several images.
void split_by_names(const nlohmann::json& top, const std::string& where, ImageRecords& records);

}  // namespace ewa::io
