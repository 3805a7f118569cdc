// SPDX-License-Identifier: Apache-2.0
// ewa bench --ranks: how fast the processes of mpirun or srun exchange data.
#pragma once
#include <filesystem>

namespace ewa::cli {

/// Prints the figures, and writes them to `json` unless it is empty. Throws InputError where the process is alone.
int run_rank_bench(const std::filesystem::path& json);

}  // namespace ewa::cli
