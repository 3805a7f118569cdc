// SPDX-License-Identifier: Apache-2.0
// Finds the files at a path that have the cameras of a dataset.
#pragma once
#include <filesystem>

#include "ewa/dataset.h"
#include "io/datasets/image_records.h"

namespace ewa::io {

/// Recognises the kind of dataset at a path, and reads its cameras and points. Throws InputError.
ImageRecords read_model(const std::filesystem::path& path, const DatasetOptions& options);

}  // namespace ewa::io
