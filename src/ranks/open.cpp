// SPDX-License-Identifier: Apache-2.0
#include "ranks/open.h"

#include <algorithm>
#include <cstdlib>

#include "core/plugin.h"
#include "ranks/launcher.h"
#include "ranks/plugin.h"

namespace ewa {
namespace ranks {

bool has_mpi() {
    return EWA_HAS_MPI;
}

const Mpi& load_mpi() {
    constexpr core::Plugin kPlugin{kMpiName, kMpiEntry,
                                   "which lets the processes of a launcher train together", core::Thing::mpi,
                                   ", or start ewa without mpirun and srun"};
    return *static_cast<const Mpi*>(core::load_plugin(kPlugin));
}

std::shared_ptr<Ranks> open_mpi(const MpiOptions& options) {
    return load_mpi().open(options);
}

}  // namespace ranks

std::shared_ptr<Ranks> open_ranks(std::chrono::milliseconds timeout) {
    const auto launcher = ranks::find_launcher([](const char* name) { return std::getenv(name); });
    if (!launcher.found) return alone();
    // Processes may start long after each other on a busy machine.
    constexpr std::chrono::milliseconds kLeastStart{10000};
    return ranks::open_mpi(
        {.timeout = timeout, .start = std::max(timeout, kLeastStart), .size = launcher.size});
}

}  // namespace ewa
