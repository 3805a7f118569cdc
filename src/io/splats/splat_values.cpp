// SPDX-License-Identifier: Apache-2.0
#include "io/splats/splat_values.h"

#include <algorithm>

#include "core/text.h"
#include "ewa/error.h"

namespace ewa::io {

void require_memory(const std::string& name, uint64_t file_bytes, uint64_t count, int sh_degree,
                    uint64_t expansion) {
    constexpr uint64_t kAlways = uint64_t(40) << 20;
    const uint64_t each = sizeof(float) * (11 + 3 * uint64_t(sh_coefficients(sh_degree)));
    if (count <= (expansion * file_bytes + kAlways) / each) return;
    throw InputError(name + ": claims " + std::to_string(count) + " splats of SH degree " +
                     std::to_string(sh_degree) + " in " + std::to_string(file_bytes) +
                     " bytes, which would unpack to more than " + std::to_string(expansion) +
                     " times the file and 40 MiB; it is damaged, or its splats repeat each other");
}

void remark_dropped_sh(const Gaussians& gaussians, std::vector<std::string>& remarks) {
    if (gaussians.sh_degree > 0)
        remarks.push_back("SH degrees 1 to " + std::to_string(gaussians.sh_degree) +
                          " are dropped: the format has no view-dependent colour");
}

}  // namespace ewa::io
