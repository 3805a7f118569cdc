// SPDX-License-Identifier: Apache-2.0
// What readers and writers of the splat formats have in common.
#pragma once
#include <cstdint>
#include <string>
#include <string_view>

#include "core/file_reader.h"
#include "ewa/splat_files.h"

namespace ewa::io {

/// How many times its size a file may take in memory: as text or bytes one number each; packed, where SH
/// coefficients of zero take next to nothing.
inline constexpr uint64_t kPlainFolds = 4, kPackedFolds = 32;

/// Throws InputError where `count` splats of a degree would take more memory than `folds` times the file and
/// 40 MiB: no scene is that repetitive, and a file of a few kB could otherwise claim all memory there is.
void require_memory(const std::string& name, uint64_t file_bytes, uint64_t count, int sh_degree,
                    uint64_t folds = kPlainFolds);

/// "SH degree 3 is left out: the format has none", where there is something to leave out.
void remark_dropped_sh(const Gaussians& gaussians, std::vector<std::string>& remarks);

}  // namespace ewa::io
