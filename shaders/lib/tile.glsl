// One subgroup owns one tile: lane l stands in column l % TILE_WIDTH and has PIXELS pixels of it, ROW_STEP rows apart.
// A batch of SUBGROUP splats lives in registers, one splat a lane, and goes round by shuffles with constant lanes.
// Needs subgroup.glsl; the including pass declares `push` (BlendPush), records, values, tile_starts.
#ifndef EWA_LIB_TILE
#define EWA_LIB_TILE
layout(constant_id = SPEC_TILE_WIDTH) const uint TILE_WIDTH = 8;
layout(constant_id = SPEC_TILE_HEIGHT) const uint TILE_HEIGHT = 8;
const uint PIXELS = TILE_WIDTH * TILE_HEIGHT / SUBGROUP;
const uint ROW_STEP = SUBGROUP / TILE_WIDTH;

// A splat as one lane meets it: u and v at the lane's first pixel, and their steps from pixel to pixel.
struct LaneSplat {
    float u, u_step, v, v_step;
    float opacity;
    vec3 color;
};

// Splat j of the batch whose records the lanes hold. pixel: centre of the lane's first pixel.
LaneSplat lane_splat(vec4 record0, vec4 record1, vec4 record2, uint j, vec2 pixel) {
    const float dx = (pixel.x - subgroupShuffle(record0.x, j)) - subgroupShuffle(record0.z, j);
    const float dy = (pixel.y - subgroupShuffle(record0.y, j)) - subgroupShuffle(record0.w, j);
    const float ux = subgroupShuffle(record1.x, j);
    const float k = subgroupShuffle(record1.y, j);
    const float vy = subgroupShuffle(record1.z, j);
    LaneSplat s;
    s.u = ux * (dx - k * dy);
    s.u_step = -ux * k * float(ROW_STEP);
    s.v = vy * dy;
    s.v_step = vy * float(ROW_STEP);
    s.opacity = subgroupShuffle(record1.w, j);
    s.color = vec3(subgroupShuffle(record2.x, j), subgroupShuffle(record2.y, j), subgroupShuffle(record2.z, j));
    return s;
}

// Transmittance is kept positive while the pixel is open, and negative from the splat on that would have taken it to
// TRANSMITTANCE_STOP or under: one float is both the value and the flag.
// Returns the splat's weight alpha * T (0 where it is skipped), and moves T on. alpha: as blended, before the stop.
float composite(float alpha, inout float T, out bool blended) {
    const float next = T - T * alpha;
    blended = next > float(TRANSMITTANCE_STOP);
    const float weight = blended ? alpha * T : 0.0;
    T = blended ? next : -abs(T);
    return weight;
}
#endif
