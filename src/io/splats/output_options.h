// SPDX-License-Identifier: Apache-2.0
// Options of an output as people give them, by the format that its name tells.
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

/// Sets them in `save`. Throws InputError for a name of no format, and for options that the output does not have.
void set_output_options(SaveOptions& save, const std::filesystem::path& file, const OutputOptions& options);

}  // namespace ewa::io
