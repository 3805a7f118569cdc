// SPDX-License-Identifier: Apache-2.0
#include "scene/dataset_files.h"

namespace ewa::scene {

std::vector<core::NamedFile> files_of(const Dataset& dataset, const std::string& what) {
    std::vector<core::NamedFile> files;
    for (const auto& path : dataset.files) files.push_back({"a file of " + what, path});
    for (const Frame& frame : dataset.frames) {
        files.push_back({"an image of " + what, frame.image_path});
        files.push_back({"a mask of " + what, frame.mask_path});
        files.push_back({"a depth map of " + what, frame.depth_path});
    }
    return files;
}

}  // namespace ewa::scene
