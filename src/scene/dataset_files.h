// SPDX-License-Identifier: Apache-2.0
// The files of a dataset, which no output may replace.
#pragma once
#include <string>
#include <vector>

#include "core/outputs.h"
#include "ewa/dataset.h"

namespace ewa::scene {

/// The files of a dataset's cameras, points, images and masks, for core::check_outputs. what: the argument that names the dataset,
/// for errors.
std::vector<core::NamedFile> files_of(const Dataset& dataset, const std::string& what);

}  // namespace ewa::scene
