// SPDX-License-Identifier: Apache-2.0
// The ranks that a launcher started together with this process.
#pragma once
#include <chrono>
#include <memory>

#include "ewa/ranks.h"

namespace ewa {

/// Under a launcher with several processes: all of them, by MPI, which the module libewa_mpi.so brings along. Else
/// alone(). Every process calls it once. timeout: of gather and exchange.
///
/// The last owner's destructor leaves MPI, which waits for the other ranks. It does not while an exception is
/// thrown, or once gather or exchange has thrown: the process then ends at once, and the launcher ends the others.
/// Throws RunError where there is no module, it does not fit, or MPI fails.
std::shared_ptr<Ranks> open_ranks(std::chrono::milliseconds timeout);

}  // namespace ewa
