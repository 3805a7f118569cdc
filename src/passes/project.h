// SPDX-License-Identifier: Apache-2.0
// Projection of splats, and its gradient with the optimiser's step.
#pragma once
#include "passes/pass.h"

namespace ewa::passes {

/// Projects every splat into pixels. Counts.skipped_nonfinite is added to. Variant: SPEC_SH_DEGREE,
/// SPEC_KERNEL, SPEC_MODE (0 or PROJECT_DEBUG).
struct Project : ElementPass {
    static constexpr char shader[] = "project";
    struct Buffers {
        gpu::BufferPart params, camera, records, depth_keys, tile_counts, counts;
    };
    using Push = shared::ProjectPush;
    static Groups groups(const KernelConfig& c, const Push& push) { return element_groups(c, push.splats); }
};

/// Gradient of the projection, fused with Adam. Variant: SPEC_SH_DEGREE,
/// SPEC_KERNEL, SPEC_MODE (UPDATE_* bits).
struct Update : ElementPass {
    static constexpr char shader[] = "update";
    struct Buffers {
        gpu::BufferPart params, camera, records, slots, moments1, moments2, tile_counts, first_instances,
            counts, params_out, moments1_out, moments2_out, statistics, sorted_indices;
    };
    using Push = shared::UpdatePush;
    static Groups groups(const KernelConfig& c, const Push& push) { return element_groups(c, push.splats); }
};

}  // namespace ewa::passes
