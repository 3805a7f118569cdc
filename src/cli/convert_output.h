// SPDX-License-Identifier: Apache-2.0
// The output of ewa convert: what its name makes it, the options that only some outputs have, and how it is written.
#pragma once
#include <filesystem>
#include <glm/mat4x4.hpp>
#include <optional>
#include <string>
#include <vector>

#include "ewa/splat_files.h"
#include "live/run_folder.h"

namespace CLI {
class App;
}

namespace ewa::cli {

/// Options that only some outputs have.
struct OutputOptions {
    int spz_version = 0, levels = 0;  // 0: not given
    bool gltf_spz = false, unbundled = false;
    std::string geo, title;
};

void add_output_options(CLI::App& app, OutputOptions& options);

struct ConvertOutput {
    std::filesystem::path file;
    bool page = false, tiles = false;
    SplatFormat format = SplatFormat::ply;  // of the splats; those of a page and of tiles have one too
    std::optional<glm::dmat4> earth;        // of tiles: from the scene's world to the earth's
};

/// What the name makes of the file. check: it is to be read back. Throws InputError for a name of no format, for options that the
/// output does not have, and where it cannot be read back.
ConvertOutput output_of(const std::filesystem::path& file, const OutputOptions& options, bool check);

/// Writes the output and its parts. gaussians: kept where the output can be read back, and else empty afterwards. save: comments, mark
/// and progress. run: see write_page. Returns what the output does not store. Throws InputError, RunError.
std::vector<std::string> write_output(const ConvertOutput& output, const OutputOptions& options,
                                      Gaussians& gaussians, SaveOptions save,
                                      const std::optional<live::Run>& run);

}  // namespace ewa::cli
