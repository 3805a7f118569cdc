// SPDX-License-Identifier: Apache-2.0
// The files that a scene is written as: splats of any format, a page that shows it in a browser, and 3D Tiles for globes.
#pragma once
#include <array>
#include <filesystem>
#include <glm/mat4x4.hpp>
#include <optional>
#include <string>
#include <vector>

#include "ewa/dataset.h"
#include "ewa/splat_files.h"

namespace ewa::report {

/// Options that only some outputs have.
struct OutputOptions {
    int spz_version = 0, levels = 0;  // 0: not given
    bool gltf_spz = false, unbundled = false;
    std::string geo, title;
};

/// Whether the name is that of a page: .html or .htm.
bool names_page(const std::filesystem::path& path);

/// The levels of an unbundled NAME.html: NAME-levels/lod-meta.json beside it.
std::filesystem::path levels_of_page(const std::filesystem::path& page);

/// Whether the path names a tileset.json.
bool names_tileset(const std::filesystem::path& path);

struct SceneOutput {
    std::filesystem::path file;
    bool page = false, tiles = false;
    SplatFormat format = SplatFormat::ply;  // of the splats; those of a page and of tiles have one too
    std::optional<glm::dmat4> earth;        // of tiles: from the scene's world to the earth's
};

/// What the name makes of the file. Throws InputError for a name of no format, and for options that the output does not have.
SceneOutput output_of(const std::filesystem::path& file, const OutputOptions& options);

/// What a page shows besides the scene.
struct PageCameras {
    Dataset dataset = {};  // its cameras are the views, in the order of their names; may be empty
    std::array<float, 3> background{};
};

/// Writes the output and its parts. gaussians: kept where ewa reads the output back, and else empty afterwards. save: comments, mark
/// and progress. Returns what the output does not store. Throws InputError, RunError.
std::vector<std::string> write_output(const SceneOutput& output, const OutputOptions& options,
                                      Gaussians& gaussians, SaveOptions save, const PageCameras& cameras);

}  // namespace ewa::report
