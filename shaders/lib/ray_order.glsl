// SPDX-License-Identifier: Apache-2.0
// The splats that each ray of a tile meets, in the order of their middles; ties in the order of the tile's list. The list is
// sorted by the least view depth of each splat. So a splat can be blended once nothing from there on can be nearer. Until
// then the lane keeps it, in order. If a lane has too many, it drops the farthest, and walks the list again from the first one
// that it dropped. The order is exact.
// Needs rays.glsl. The including pass declares HELD before this file.
#ifndef EWA_LIB_RAY_ORDER
#define EWA_LIB_RAY_ORDER

struct RayOrder {
    float depths[HELD], alphas[HELD];  // view depths; NEVER: empty
    uint instances[HELD];
    float bound;                       // what is not nearer was dropped
    uint bound_at, redo;               // instance of the bound; the first instance that was dropped
};

void hold(inout RayOrder o, float depth, float alpha, uint at) {
    [[unroll]] for (uint i = 0u; i < HELD; ++i) {
        const bool before = depth < o.depths[i];
        const float d = o.depths[i], a = o.alphas[i];
        const uint n = o.instances[i];
        o.depths[i] = before ? depth : d;
        o.alphas[i] = before ? alpha : a;
        o.instances[i] = before ? at : n;
        depth = before ? d : depth;
        alpha = before ? a : alpha;
        at = before ? n : at;
    }
    const bool dropped = depth < NEVER;
    o.bound = dropped ? depth : o.bound;
    o.bound_at = dropped ? at : o.bound_at;
    o.redo = dropped ? min(o.redo, at) : o.redo;
}

void release(inout RayOrder o, bool first) {
    [[unroll]] for (uint i = 0u; i < HELD - 1u; ++i) {
        o.depths[i] = first ? o.depths[i + 1u] : o.depths[i];
        o.alphas[i] = first ? o.alphas[i + 1u] : o.alphas[i];
        o.instances[i] = first ? o.instances[i + 1u] : o.instances[i];
    }
    o.depths[HELD - 1u] = first ? NEVER : o.depths[HELD - 1u];
}

// 1 - exp(-depth), 0 below the cut-off.
float alpha_of_depth(float depth) {
    EXACT const float alpha = 1.0 - exp(-depth);
    return alpha >= CUT_OFF ? min(float(ALPHA_MAX), alpha) : 0.0;
}
#endif
