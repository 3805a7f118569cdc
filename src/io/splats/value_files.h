// SPDX-License-Identifier: Apache-2.0
// Formats whose values are in files beside the file that names them: a .gltf, and the meta.json of a SOG. New values get
// names that no file has, so that the rename of the naming file replaces everything at once, and no file of others is
// touched.
#pragma once
#include <filesystem>
#include <vector>

namespace ewa::io {

using Paths = std::vector<std::filesystem::path>;

/// What writing a naming file does beside it.
struct ValueFiles {
    Paths written;
    Paths removed;  // older values, once the naming file is in its place
};

/// `usual`: the names of the values where all of them are free; else all end in -2, in -3 and so on. `named_by`: the
/// values that an existing naming file names, empty if there is none. Values of `naming` with such a
/// name are removed, unless another naming file in the folder names them too.
ValueFiles value_files(const std::filesystem::path& naming, const Paths& usual,
                       Paths (*named_by)(const std::filesystem::path&));

/// Failures are ignored: the values are of no use, and no harm.
void remove_values(const ValueFiles& files);

}  // namespace ewa::io
