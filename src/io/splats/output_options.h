// SPDX-License-Identifier: Apache-2.0
// Options of a splat file to write, as users type them. The file's name gives the format.
#pragma once
#include <filesystem>
#include <string>

#include "ewa/splat_scene.h"

namespace ewa::io {

/// Options that only some outputs have.
struct OutputOptions {
    int spz_version = 0, levels = 0;  // 0: not given
    bool gltf_spz = false, unbundled = false;
    std::string geo, title;
};

/// Sets the options in `save`. Throws InputError if the file's name has no known format, or the format lacks an option.
void set_output_options(SaveOptions& save, const std::filesystem::path& file, const OutputOptions& options);

}  // namespace ewa::io
