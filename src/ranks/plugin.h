// SPDX-License-Identifier: Apache-2.0
// The functions of libewa_mpi.so. It alone links MPI, and it is loaded only under a launcher.
#pragma once
#include <chrono>
#include <cstddef>
#include <memory>

#include "ewa/ranks.h"

namespace ewa::ranks {

struct MpiOptions {
    std::chrono::milliseconds timeout;   // of gather and exchange
    std::chrono::milliseconds start{0};  // of MPI's start; 0: no limit
    int size = 0;                        // the processes that the launcher started; 0: it does not say
    // Longer parts travel in several messages: MPI counts bytes with an int, and each one that arrives shows that data
    // still flow.
    size_t message_bytes = size_t(4) << 20;
};

struct Mpi {
    const char* version;  // EWA_VERSION; the loader reads it before it calls a function
    std::shared_ptr<Ranks> (*open)(const MpiOptions& options);
};
constexpr const char* kMpiName = "libewa_mpi";
/// Ends in the number of the layout. Count it up whenever a type above or Ranks changes: a module of another layout
/// then has no such entry, and is refused.
constexpr const char* kMpiEntry = "ewa_mpi_layout_2";

/// Whether this build of ewa has the module.
bool has_mpi();
/// Loads the module. Throws RunError.
const Mpi& load_mpi();
/// Loads the module and enters MPI. Throws RunError.
std::shared_ptr<Ranks> open_mpi(const MpiOptions& options);

}  // namespace ewa::ranks
