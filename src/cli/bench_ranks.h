// SPDX-License-Identifier: Apache-2.0
// ewa bench --ranks: the network between the processes of mpirun or srun, and what a scene's training costs with it.
#pragma once
#include <cstdint>
#include <filesystem>
#include <string>

namespace CLI {
class App;
}

namespace ewa::cli {

struct RankBench {
    bool asked = false;
    // The scene, where none is measured.
    uint64_t splats = 1000000;
    double visible_percent = 30, view_ms = 100;
    bool absolute_gradients = false;
};

void add_rank_options(CLI::App& app, RankBench& bench);

/// dataset and splats: the scene to measure on this device; both empty: none. json: not written where it is empty.
int run_rank_bench(const RankBench& bench, const std::filesystem::path& dataset,
                   const std::filesystem::path& splats, const std::string& device,
                   const std::filesystem::path& json);

}  // namespace ewa::cli
