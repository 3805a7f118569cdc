// SPDX-License-Identifier: Apache-2.0
// The images of ewa render as files.
#pragma once
#include <filesystem>
#include <string>

#include "cli/output.h"
#include "ewa/renderer.h"

namespace ewa::cli {

/// The kind of render that --mode needs. Opacity is part of a colour render.
Drawing drawing_of(const std::string& mode);

struct ImageKind {
    std::string mode, format;  // --mode; png, jpg or exr
    bool transparent = false;
};

/// Writes the image of one view, and creates its folder. panorama: the image is a 360° one. Prints through `progress` a remark on
/// facts that the file cannot store, such as the depth that white shows. Throws RunError if the file cannot be written.
void save_render(const std::filesystem::path& file, Rendering&& rendering, const ImageKind& kind,
                 bool panorama, Progress& progress);

}  // namespace ewa::cli
