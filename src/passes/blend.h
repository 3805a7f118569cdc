// SPDX-License-Identifier: Apache-2.0
// Blending of splats into image planes, and its gradient.
#pragma once
#include "passes/pass.h"

namespace ewa::passes {

/// One subgroup owns one tile.
struct TilePass : SubgroupPass {
    using Push = shared::BlendPush;
    static Groups groups(const KernelConfig& c, const Push& push) { return tile_groups(c, push); }
};

/// Blends the splats of every tile into the image planes. Variant: SPEC_MODE (BLEND_*).
struct Blend : TilePass {
    static constexpr char shader[] = "blend";
    struct Buffers {
        gpu::BufferPart records, splats, tile_starts, planes;
    };
};

/// Gradient of blending, written to the slot of every (splat, tile) instance. Variant:
/// SPEC_MODE (0 or BLEND_BACKWARD_ABSOLUTE).
struct BlendBackward : TilePass {
    static constexpr char shader[] = "blend_backward";
    struct Buffers {
        gpu::BufferPart records, splats, tile_starts, planes, image_gradient, slots;
    };
};

/// Packs the colour planes into 8-bit RGBA. packed: plane_floats words.
struct Pack : ElementPass {
    static constexpr char shader[] = "pack";
    struct Buffers {
        gpu::BufferPart planes, packed;
    };
    using Push = shared::PackPush;
    static Groups groups(const KernelConfig& c, const Push& push) {
        return element_groups(c, push.plane_floats / 4);
    }
};

}  // namespace ewa::passes
