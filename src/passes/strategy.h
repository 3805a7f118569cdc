// SPDX-License-Identifier: Apache-2.0
// Passes of the strategies that change the number of splats: adaptive density control and MCMC.
#pragma once
#include "passes/pass.h"

namespace ewa::passes {

/// Decides how many splats each splat becomes.
struct DensifyDecide : ElementPass {
    static constexpr char shader[] = "densify_decide";
    struct Buffers {
        gpu::BufferPart params, statistics, outputs;
    };
    using Push = shared::DensifyPush;
    static Groups groups(const KernelConfig& c, const Push& push) { return element_groups(c, push.splats); }
};

/// Writes the next generation of splats. Variant: SPEC_SH_DEGREE (stored).
struct DensifyWrite : ElementPass {
    static constexpr char shader[] = "densify_write";
    struct Buffers {
        gpu::BufferPart params, moments1, moments2, statistics, prefix, totals, params_out, moments1_out,
            moments2_out;
    };
    using Push = shared::DensifyPush;
    static Groups groups(const KernelConfig& c, const Push& push) { return element_groups(c, push.splats); }
};

/// Lowers every opacity to at most a given one and zeroes its moments.
struct ResetOpacity : ElementPass {
    static constexpr char shader[] = "reset_opacity";
    struct Buffers {
        gpu::BufferPart params, moments1, moments2;
    };
    using Push = shared::ResetPush;
    static Groups groups(const KernelConfig& c, const Push& push) { return element_groups(c, push.splats); }
};

/// Writes each splat's weight as a source, and whether it is dead.
struct McmcWeigh : ElementPass {
    static constexpr char shader[] = "mcmc_weigh";
    struct Buffers {
        gpu::BufferPart params, weights, dead;
    };
    using Push = shared::McmcPush;
    static Groups groups(const KernelConfig& c, const Push& push) { return element_groups(c, push.splats); }
};

/// Draws the sources of relocated and added splats, and counts their hits.
struct McmcDraw : ElementPass {
    static constexpr char shader[] = "mcmc_draw";
    struct Buffers {
        gpu::BufferPart prefix, totals, sources, hits;
    };
    using Push = shared::McmcPush;
    static Groups groups(const KernelConfig& c, const Push& push) { return element_groups(c, push.draws); }
};

/// Writes the next generation of splats. prefix, totals: of dead. Variant: SPEC_SH_DEGREE (stored).
struct McmcWrite : ElementPass {
    static constexpr char shader[] = "mcmc_write";
    struct Buffers {
        gpu::BufferPart params, moments1, moments2, dead, prefix, totals, sources, hits, params_out,
            moments1_out, moments2_out;
    };
    using Push = shared::McmcPush;
    static Groups groups(const KernelConfig& c, const Push& push) {
        return element_groups(c, push.new_splats);
    }
};

/// Adds noise to the means.
struct Perturb : ElementPass {
    static constexpr char shader[] = "perturb";
    struct Buffers {
        gpu::BufferPart params, counts;
    };
    using Push = shared::PerturbPush;
    static Groups groups(const KernelConfig& c, const Push& push) { return element_groups(c, push.splats); }
};

}  // namespace ewa::passes
