// SPDX-License-Identifier: Apache-2.0
// ewa.Dataset, which never changes once it is made.
#pragma once
#include <nanobind/nanobind.h>

#include <filesystem>
#include <memory>
#include <vector>

#include "ewa/dataset.h"

namespace ewa::python {

using SharedDataset = std::shared_ptr<const Dataset>;

struct LoadedDataset {
    SharedDataset dataset;
    std::filesystem::path
        path;  // absolute; it and the options below load the dataset again in another process
    DatasetOptions options;
};

/// Indices of frames from Python. Throws IndexError that names the argument.
std::vector<int> frames_of(nanobind::handle value, const Dataset& dataset, const char* name);

}  // namespace ewa::python
