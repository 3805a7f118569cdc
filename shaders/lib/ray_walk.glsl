// SPDX-License-Identifier: Apache-2.0
// The walk of a strip's rays through the list of their tile, which ray_order.glsl describes. The including pass declares T,
// negative where the pixel is closed, and defines blend_held before this file.
#ifndef EWA_LIB_RAY_WALK
#define EWA_LIB_RAY_WALK

// Holds the splats of the block that count on this lane's ray and are from `start` on.
void hold_block(inout RayOrder o, RaySplat own, Ray ray, float start, uint start_at) {
    [[unroll]] for (uint j = 0; j < RAY_BLOCK; ++j) {
        const RaySplat r = shared_ray_splat(own, j);
        const Meeting m = meet(r, ray);
        const float alpha = alpha_of_depth(m.depth);
        const bool counts = T > 0.0 && alpha > 0.0 && m.middle > float(NEAR_PLANE) &&
                            (m.middle > start || (m.middle == start && r.at >= start_at));
        const bool late = counts && m.middle >= o.bound;
        o.redo = late ? min(o.redo, r.at) : o.redo;
        hold(o, counts && !late ? m.middle : NEVER, alpha, r.at);
    }
}

void walk_rays(uint tile, uint strip, Ray ray) {
    const float top = strip_top(tile, strip), bottom = top + float(ROW_STEP - 1u);
    const uint end = tile_starts[tile + 1u];
    uint begin = tile_starts[tile];
    float start = 0.0;
    uint start_at = 0u;
    // Each walk closes a pixel, or blends some of its splats for good.
    for (uint walk = 0u; walk < end; ++walk) {
        RayOrder o;
        [[unroll]] for (uint i = 0u; i < HELD; ++i) {
            o.depths[i] = NEVER;
            o.alphas[i] = 0.0;
            o.instances[i] = 0u;
        }
        o.bound = NEVER;
        o.bound_at = o.redo = end;
        uint k = begin;
        bool done = false;
        for (uint turn = begin; turn < end; ++turn) {
            if (!in_time() || k >= end || done) break;
            const uint count = choose(k, end, top, bottom, 0.0, NEVER);
            RaySplat own;
            [[dont_unroll]] for (uint i = 0u; i < count; i += RAY_BLOCK) {
                if (!in_time() || done) break;
                next_block(own, i, count);
                const float to_come = subgroupShuffle(own.bend.w, 0u);
                // The splats wait as long as there is room: lanes then blend more of them at a time.
                const bool room = subgroupAll(o.depths[HELD / 2u] == NEVER);
                blend_held(o, room ? 0.0 : to_come);
                hold_block(o, own, ray, start, start_at);
                done = subgroupAll(T <= 0.0 || o.bound <= to_come);
            }
        }
        blend_held(o, NEVER);
        const bool more = T > 0.0 && o.bound < NEVER;
        if (!in_time() || subgroupAll(!more)) break;
        start = more ? o.bound : NEVER;
        start_at = o.bound_at;
        begin = subgroup_min(more ? o.redo : end);
    }
}
#endif
