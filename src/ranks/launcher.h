// SPDX-License-Identifier: Apache-2.0
// The launcher (mpirun, srun) that started this process, by the environment.
#pragma once
#include <functional>
#include <string>

namespace ewa::ranks {

struct Launcher {
    bool found = false;  // it started more than one process, or does not say how many
    int size = 0;        // the processes that it started; 0: it does not say
};

/// variable(name): its value, or null, as std::getenv gives it. Knows the variables of Open MPI, of PMIx and PMI
/// (MPICH, Slurm), and those of a Slurm step without either.
Launcher find_launcher(const std::function<const char*(const char*)>& variable);

}  // namespace ewa::ranks
