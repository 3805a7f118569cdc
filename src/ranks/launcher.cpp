// SPDX-License-Identifier: Apache-2.0
#include "ranks/launcher.h"

#include "core/text.h"

namespace ewa::ranks {

Launcher find_launcher(const std::function<const char*(const char*)>& variable) {
    // Not SLURM_NTASKS, which a batch script has that starts ewa without srun.
    for (const char* name : {"OMPI_COMM_WORLD_SIZE", "PMI_SIZE", "SLURM_STEP_NUM_TASKS"}) {
        const char* text = variable(name);
        if (const auto size = core::parse_integer<int>(text ? text : ""); size && *size > 0)
            return {*size > 1, *size};
    }
    return {variable("PMIX_RANK") != nullptr, 0};
}

}  // namespace ewa::ranks
