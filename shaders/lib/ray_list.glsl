// SPDX-License-Identifier: Apache-2.0
// The splats of a tile as its rays meet them, in the order of the tile's list. One subgroup owns one tile, and a lane has PIXELS
// pixels of it as in tile.glsl. A batch is SUBGROUP splats: each lane loads one, and all lanes read it from shared memory.
// Needs rays.glsl.
#ifndef EWA_LIB_RAY_LIST
#define EWA_LIB_RAY_LIST

shared vec4 ray_batch[5u * SUBGROUP];

// Loads the batch that begins at instance k. Beyond the list's end there are splats without depth.
void load_ray_batch(uint k, uint end) {
    const uint at = min(k + LANE, end - 1u), splat = splats[at];
    const RaySplat own = read_ray_splat(at);
    const vec4 record0 = fetch(records, RECORD_TEXELS * splat), record1 = fetch(records, RECORD_TEXELS * splat + 1u);
    const float half_height = 1.002 / record1.z + 1e-3;
    subgroupBarrier();  // the last batch has been read
    ray_batch[5u * LANE] = own.mean;
    ray_batch[5u * LANE + 1u] = vec4(own.shape.xyz, k + LANE < end ? own.shape.w : 0.0);
    ray_batch[5u * LANE + 2u] = own.bend;
    ray_batch[5u * LANE + 3u] = own.color;
    ray_batch[5u * LANE + 4u] = vec4(record0.y - half_height, record0.y + half_height, uintBitsToFloat(at), 0.0);
    subgroupMemoryBarrierShared();
    subgroupBarrier();
}

// Splat j of the batch. `along` is not set. rows: between which pixel centres rays meet it.
RaySplat ray_splat_of_batch(uint j, out vec2 rows) {
    const vec4 last = ray_batch[5u * j + 4u];
    rows = last.xy;
    return RaySplat(floatBitsToUint(last.z), ray_batch[5u * j], ray_batch[5u * j + 1u], ray_batch[5u * j + 2u], ray_batch[5u * j + 3u], 0.0);
}

// The lane's pixel p.
uvec2 ray_pixel(uint tile, uint p) { return strip_pixel(tile, p); }

// Whether rays through the rows of the pixels p can meet a splat.
bool reaches_rows(uint tile, uint p, vec2 rows) {
    const float top = strip_top(tile, p);
    return top <= rows.y && top + float(ROW_STEP - 1u) >= rows.x;
}

// The alpha of a meeting, 0 where it does not count.
float alpha_of_meeting(Meeting m) {
    EXACT const float alpha = 1.0 - exp(-m.depth);
    return alpha >= CUT_OFF && m.middle > float(NEAR_PLANE) ? min(float(ALPHA_MAX), alpha) : 0.0;
}
#endif
