// SPDX-License-Identifier: Apache-2.0
// Splat scenes on disk.
#pragma once
#include <filesystem>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "ewa/gaussians.h"

namespace ewa {

/// How each is laid out: src/io/ply.h, compressed_ply.h, splat.h, spz.h, gltf_splats.h.
enum class SplatFormat { ply, compressed_ply, splat, spz, glb, gltf };

/// As the messages call it, e.g. "SPZ".
std::string_view name_of(SplatFormat format);

/// By extension: .ply .compressed.ply .splat .spz .glb .gltf, in upper or lower case. Throws InputError for
/// any other.
SplatFormat format_of_name(const std::filesystem::path& path);

/// By what the file begins with; where that does not tell, as for .splat, by extension. Throws InputError.
SplatFormat format_of_file(const std::filesystem::path& path);

/// A scene and what its file says besides.
struct SplatScene {
    Gaussians gaussians;  // in the frame of an INRIA PLY (x right, y down, z forward), whichever the file has
    SplatFormat format = SplatFormat::ply;
    std::string variant;       // within the format, e.g. "version 3", "ascii"; may be empty
    int file_sh_degree = 0;    // may be above 3: what is above is left out of gaussians
    bool antialiased = false;  // the file says that it was trained with --antialias (Mip-Splatting)
    std::vector<std::string> comments;
    std::vector<std::string> remarks;  // one line each: what the file holds that is not taken
};

/// In any of the formats. Memory: at most twice the larger of the file and the scene. A file that claims more
/// than 4 times its size (SPZ, which is packed: 32 times) and 40 MiB is refused. A value may be not finite
/// where the format can hold that. Throws InputError that names the file and the byte or property.
SplatScene read_splats(const std::filesystem::path& path);

/// The scene alone. What is not taken of the file is a warning.
Gaussians load_splats(const std::filesystem::path& path);

struct SaveOptions {
    std::vector<std::string> comments = {};  // one line each, where the format has room for them
    bool antialiased = false;
    int spz_version = 3;                                    // 3 or 4
    std::function<void(uint64_t, uint64_t)> progress = {};  // splats written, splats in all
};

/// By extension. Written beside and renamed, so the path never holds half a file. Any format but .ply leaves
/// out the splats that are not drawable. Returns one line for each thing that the format cannot hold: what is
/// dropped, and the number of bits of what is quantised. Throws RunError (disk), InputError (extension,
/// values that the format has no room for, or a .bin in the place of a .gltf's that is another's).
std::vector<std::string> save_splats(const std::filesystem::path& path, const Gaussians& gaussians,
                                     const SaveOptions& options);

/// comments: one PLY comment line each.
void save_splats(const std::filesystem::path& path, const Gaussians& gaussians,
                 const std::vector<std::string>& comments = {});

}  // namespace ewa
