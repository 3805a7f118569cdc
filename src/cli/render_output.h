// SPDX-License-Identifier: Apache-2.0
// The images of ewa render as files.
#pragma once
#include <filesystem>
#include <string>

#include "cli/output.h"
#include "ewa/renderer.h"

namespace ewa::cli {

/// What to draw for --mode; opacity comes with colours.
Drawing drawing_of(const std::string& mode);

struct ImageKind {
    std::string mode, format;  // --mode; png, jpg or exr
    bool transparent = false;
};

/// Writes the image of one view, and makes its folder. panorama: it shows all directions. progress gets a remark where the file does not
/// hold a fact, such as the depth of white. Throws RunError if the file cannot be written.
void save_render(const std::filesystem::path& file, Rendering&& rendering, const ImageKind& kind,
                 bool panorama, Progress& progress);

}  // namespace ewa::cli
