// SPDX-License-Identifier: Apache-2.0
// One subgroup owns one tile. Lane l has column l % TILE_WIDTH and PIXELS pixels of it, ROW_STEP rows apart.
// A batch of SUBGROUP splats is in registers, one splat a lane, and is broadcast by shuffles with constant lanes.
// Needs subgroup.glsl. The including pass declares `push` (BlendPush), records, splats and tile_starts.
#ifndef EWA_LIB_TILE
#define EWA_LIB_TILE
layout(constant_id = SPEC_TILE_WIDTH) const uint TILE_WIDTH = 8;
layout(constant_id = SPEC_TILE_HEIGHT) const uint TILE_HEIGHT = 8;
const uint PIXELS = TILE_WIDTH * TILE_HEIGHT / SUBGROUP;
const uint ROW_STEP = SUBGROUP / TILE_WIDTH;

// A lane's column is evaluated in segments. exp() is computed at pixel SEGMENT_BASE of a segment. The other pixels follow
// by two products each: exp(-(a + b p + c p^2)) is a geometric sequence whose ratio is itself a geometric sequence.
// The low-pass bounds the slope of a footprint (|step of (u, v)| <= sqrt(1 / (2 LOW_PASS)) a pixel), so within 4 pixels of
// the base no visible value overflows or underflows. A column of fewer than 4 pixels is evaluated pixel by pixel.
const uint SEGMENT = PIXELS < 8u / ROW_STEP ? PIXELS : 8u / ROW_STEP;
const uint SEGMENT_BASE = (SEGMENT - 1u) / 2u;
const bool BY_RATIO = SEGMENT >= 4u;

// A splat as one lane evaluates it: u and v at the lane's first pixel, and their steps from pixel to pixel.
struct LaneSplat {
    float u, u_step, v, v_step;
    float ratio_step;   // exp(-2 (u_step^2 + v_step^2))
    float opacity;
    vec3 color;
};

// Ratio step of the splat that a lane loads for the batch. record1: as projected.
float ratio_step_of(vec4 record1) {
    const float u_step = record1.x * record1.y * float(ROW_STEP), v_step = record1.z * float(ROW_STEP);
    return exp(-2.0 * (u_step * u_step + v_step * v_step));
}

// Splat j of the batch, from the records in the lanes. pixel: centre of the lane's first pixel.
LaneSplat lane_splat(vec4 record0, vec4 record1, vec4 record2, float ratio_step, uint j, vec2 pixel) {
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
    s.ratio_step = subgroupShuffle(ratio_step, j);
    s.opacity = subgroupShuffle(record1.w, j);
    s.color = vec3(subgroupShuffle(record2.x, j), subgroupShuffle(record2.y, j), subgroupShuffle(record2.z, j));
    return s;
}

// opacity exp(-(u^2 + v^2)) at each of the lane's pixels.
void column_alphas(LaneSplat s, out float raw[PIXELS]) {
    float ratio = 0.0;
    [[unroll]] for (uint p = 0; p < PIXELS; ++p) {
        if (!BY_RATIO || p % SEGMENT == SEGMENT_BASE) {
            const float u = s.u + s.u_step * float(p), v = s.v + s.v_step * float(p);
            raw[p] = s.opacity * exp(-(u * u + v * v));
            ratio = exp(-(s.u_step * (2.0 * u + s.u_step) + s.v_step * (2.0 * v + s.v_step)));
        } else if (p % SEGMENT > SEGMENT_BASE) {
            raw[p] = raw[p - 1u] * ratio;
            ratio *= s.ratio_step;
        }
    }
    [[unroll]] for (uint q = 0; q < PIXELS; ++q) {
        const uint p = PIXELS - 1u - q;
        if (BY_RATIO && p % SEGMENT == SEGMENT_BASE) {
            const float u = s.u + s.u_step * float(p), v = s.v + s.v_step * float(p);
            ratio = exp(s.u_step * (2.0 * u - s.u_step) + s.v_step * (2.0 * v - s.v_step));
        } else if (BY_RATIO && p % SEGMENT < SEGMENT_BASE) {
            raw[p] = raw[p + 1u] * ratio;
            ratio *= s.ratio_step;
        }
    }
}

// A NaN contributes nothing.
float alpha_of(float raw) { return raw >= CUT_OFF ? min(float(ALPHA_MAX), raw) : 0.0; }

// T is positive while the pixel is open. It becomes negative at the splat that would have taken it to TRANSMITTANCE_STOP or
// below: one float is both value and flag.
// Returns the splat's weight alpha * T (0 if it is skipped), and updates T. alpha: as blended, before the stop.
float composite(float alpha, inout float T, out bool blended) {
    const float next = T - T * alpha;
    blended = next > float(TRANSMITTANCE_STOP);
    const float weight = blended ? alpha * T : 0.0;
    T = blended ? next : -abs(T);
    return weight;
}
#endif
