// Splat scenes on disk.
#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "ewa/gaussians.h"

namespace ewa {

/// By extension; .ply: INRIA layout, read by property name (docs of the format: src/io/ply.h). Throws InputError that
/// names the file and the byte or property.
Gaussians load_splats(const std::filesystem::path& path);

/// By extension; .ply: binary little endian, INRIA's properties in INRIA's order. Written beside and renamed, so the
/// path never holds half a file. comments: one PLY comment line each. Throws RunError (disk), InputError (extension).
void save_splats(const std::filesystem::path& path, const Gaussians& gaussians,
                 const std::vector<std::string>& comments = {});

}  // namespace ewa
