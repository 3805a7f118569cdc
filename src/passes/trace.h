// SPDX-License-Identifier: Apache-2.0
// Ray tracing of mesh scenes. Variant of each: SPEC_ALPHA_TESTED. The number of workgroups follows from the
// view's pixels, so record is given it.
#pragma once
#include "passes/pass.h"

namespace ewa::passes {

/// A mesh scene's buffers, bindings 0 to 5; shared/layouts.h describes their contents.
struct MeshBuffers {
    gpu::BufferPart nodes, triangles, surfaces, materials, textures, texels;
};

/// Path tracing: light that reaches a camera.
struct TracePaths : ElementPass {
    static constexpr char shader[] = "trace_paths";
    struct Buffers {
        MeshBuffers mesh;
        gpu::BufferPart lights, view, sums, counts;
    };
    using Push = shared::TracePush;
};

/// What the centre of each pixel sees.
struct TraceDepth : ElementPass {
    static constexpr char shader[] = "trace_depth";
    struct Buffers {
        MeshBuffers mesh;
        gpu::BufferPart view, seen, counts;
    };
    using Push = shared::TracePush;
};

}  // namespace ewa::passes
