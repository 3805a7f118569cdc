// SPDX-License-Identifier: Apache-2.0
// An edit of the splats of a training.
#pragma once
#include <cstdint>
#include <vector>

namespace ewa {

/// An edit of the splats that are trained. Indices count the splats of Trainer::gaussians, in any order.
struct SplatEdit {
    std::vector<uint32_t> remove = {};
    /// A frozen splat is drawn, but no step changes it, and no refinement copies, moves or removes it.
    std::vector<uint32_t> freeze = {};
    std::vector<uint32_t> unfreeze =
        {};  // such a splat learns again, from moments of zero; `freeze` and `remove` win
};

}  // namespace ewa
