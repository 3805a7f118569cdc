// SPDX-License-Identifier: Apache-2.0
// Streamed SOG (PlayCanvas): a lod-meta.json beside folders with unpacked SOGs, the chunks. Level 0 is the scene, and each further
// level has fewer splats.
//   version    1; older files lack it
//   lodLevels  how many levels there are
//   counts     the splats of each level; count is their sum
//   filenames  the meta.json of each chunk
//   tree       inner nodes have `bound` and `children`, leaves `bound` and `lods`: by level, the rows offset to offset + count
//              of the chunk with the index `file`
//   lodErrors  true where leaves have `errors`: of each level, how much of the leaf's finest level it lacks, as a part of that. 0 for
//              the finest and for levels that the leaf has no splats of; readers compare the numbers of all leaves
//   environment  the meta.json of a SOG that is shown at all levels
// A bound is the box of the leaf's ellipsoids at one standard deviation, over all levels. The frame is that of an INRIA PLY.
#pragma once
#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

namespace ewa::io {

inline constexpr const char* kLevelsName = "lod-meta.json";
inline constexpr size_t kMostLevels = 32;

/// The numbers of splats of the levels as text, such as "100, 50, 25".
std::string counts_text(const std::vector<size_t>& counts);

/// Whether write_levels makes folders with such a name: LEVEL_CHUNK, or with a number more where that existed.
bool names_chunk_folder(std::string_view name);

}  // namespace ewa::io
