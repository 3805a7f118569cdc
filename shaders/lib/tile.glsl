// SPDX-License-Identifier: Apache-2.0
// One subgroup owns one tile. Lane l has column l % TILE_WIDTH and PIXELS pixels of it, ROW_STEP rows apart.
// A batch is SUBGROUP splats of the tile's list. Each lane loads one; SPEC_BROADCAST says how all lanes come to read it.
// With SPEC_QUADS a workgroup has the subgroups of a quad. They stage a batch of its list together, and each picks its own.
// A batch is evaluated in blocks of BLOCK splats. A block is unrolled. On a GPU, unrolling all blocks would outgrow the
// instruction cache. On a CPU, shuffles are fast only with constant lanes.
// Needs subgroup.glsl. The including pass declares `push` (BlendPush), records, splats and tile_starts before this file.
// With BINDING_INDICES it may have SLOTS_EMITTED: splats are in the order of emission too then.
#ifndef EWA_LIB_TILE
#define EWA_LIB_TILE
#include "lib/density.glsl"
layout(constant_id = SPEC_TILE_WIDTH) const uint TILE_WIDTH = 8;
layout(constant_id = SPEC_TILE_HEIGHT) const uint TILE_HEIGHT = 8;
layout(constant_id = SPEC_WRAP) const uint WRAP = 0u;  // dx is that of the nearer of the splat's images
layout(constant_id = SPEC_KERNEL) const uint KERNEL = KERNEL_PEAK;
const bool BY_DEPTH = KERNEL == KERNEL_DENSITY;  // a record's opacity is an optical depth
layout(constant_id = SPEC_PARTS) const uint PARTS = 0;
const uint PART_COLUMNS = TILE_WIDTH > PART_SIZE ? TILE_WIDTH / PART_SIZE : 1u;
const uint PIXELS = TILE_WIDTH * TILE_HEIGHT / SUBGROUP;
const uint ROW_STEP = SUBGROUP / TILE_WIDTH;

// A lane's column is evaluated in segments. exp() is computed at pixel SEGMENT_BASE of a segment. The other pixels follow
// by two products each: exp(-(a + b p + c p^2)) is a geometric sequence whose ratio is itself a geometric sequence.
// The low-pass bounds the slope of a footprint (|step of (u, v)| <= sqrt(1 / (2 LOW_PASS)) a pixel), so within 4 pixels of
// the base no visible value overflows or underflows. With LOW_PASS_ANTIALIAS that holds within 2 pixels. A column of fewer
// than 4 pixels is evaluated pixel by pixel, and so is each where the caller's footprints may be sharper (SPEC_SHARP).
layout(constant_id = SPEC_SHARP) const uint SHARP = 0;
const uint SEGMENT_ROWS = KERNEL == KERNEL_ANTIALIAS && ROW_STEP <= 4u ? 4u : 8u;
const uint SEGMENT = PIXELS < SEGMENT_ROWS / ROW_STEP ? PIXELS : SEGMENT_ROWS / ROW_STEP;
const uint SEGMENT_BASE = (SEGMENT - 1u) / 2u;
const bool BY_RATIO = SEGMENT >= 4u && SHARP == 0u;

layout(constant_id = SPEC_BROADCAST) const uint BROADCAST = BROADCAST_SHUFFLES;
const uint BLOCK = SUBGROUP < 8u ? SUBGROUP : 8u;
layout(constant_id = SPEC_QUADS) const uint QUADS = 0;
const bool IN_QUADS = QUADS != 0u;
const uint CREW = QUADS != 0u ? QUAD_TILES * SUBGROUP : SUBGROUP;  // invocations of a workgroup
const uint BATCH = QUADS != 0u ? QUADS : SUBGROUP;
shared vec4 shared_batch[QUADS != 0u || BROADCAST == BROADCAST_SHARED ? RECORD_TEXELS * BATCH : 1u];
shared uint shared_words[QUADS != 0u ? BATCH : 1u];                // of the batch; 0 behind the list's end
shared uint shared_picks[QUADS != 0u ? QUAD_TILES * BATCH : 1u];  // of each tile: the places in the batch of its splats
shared uint shared_open[QUADS != 0u ? QUAD_TILES : 1u];
uint open_tiles = (1u << QUAD_TILES) - 1u;  // of a quad: bits of the tiles with an open pixel

// The splat that this lane loaded.
struct Loaded {
    uint first, end;  // of the batch, and of the tile's list
    // With QUADS: open_tiles before the batch, number of splats that this subgroup has picked, and where its evaluation ends.
    uint open, picks, turns;
    vec4 record0, record1, record2;
    float ratio_step;
};

// Forward and backward passes must agree on the pixels that a splat reaches. A GPU's compiler may contract one of them and
// not the other, so what decides that is precise there. CPU drivers contract neither.
#ifdef EWA_TEXEL_BUFFERS
#define EXACT
#define UNROLL_BLOCKS [[unroll]]
#else
#define EXACT precise
#define UNROLL_BLOCKS [[dont_unroll]]
#endif

// A splat as one lane evaluates it: u and v at the lane's first pixel, and their steps from pixel to pixel.
struct LaneSplat {
    float u, u_step, v, v_step;
    float ratio_step;   // exp(-2 (u_step^2 + v_step^2))
    float opacity;
    vec3 color;
    float z;     // depth
    float part;  // of the tile, with PARTS
};

#ifdef BINDING_INDICES
layout(set = 0, binding = BINDING_INDICES, scalar) readonly buffer Indices { uint indices[]; };
layout(constant_id = SPEC_SLOTS) const uint SLOTS = SLOTS_SORTED;
#define slot_of(INSTANCE) (SLOTS == SLOTS_EMITTED ? indices[INSTANCE] : (INSTANCE))
#else
#define slot_of(INSTANCE) (INSTANCE)
#endif

const uint SPLAT_BITS = (1u << PART_SHIFT) - 1u;

uint splat_of(uint instance) {
    const uint word = splats[slot_of(instance)];
    return PARTS != 0u || QUADS != 0u ? word & SPLAT_BITS : word;
}

// Texel 0 of the record of an instance. With PARTS, z is the instance's part: such records have no low digits of the mean.
vec4 first_texel(uint instance, uint at) {
    vec4 texel = fetch(records, at);
    if (PARTS != 0u) texel.z = float(splats[instance] >> PART_SHIFT);
    return texel;
}

// The lane's first pixel. list: of a tile or of a quad.
uvec2 first_pixel(uint list) {
    const uint lane = LANE;
    uvec2 tile = uvec2(list % push.tiles[0], list / push.tiles[0]);
    if (QUADS != 0u) tile = 2u * tile + uvec2(SUBGROUP_INDEX % 2u, SUBGROUP_INDEX / 2u);
    return uvec2(TILE_WIDTH, TILE_HEIGHT) * tile + uvec2(lane % TILE_WIDTH, lane / TILE_WIDTH);
}

// This invocation's place in a batch, where it is below BATCH.
uint own_place() { return QUADS != 0u ? SUBGROUP_INDEX * SUBGROUP + LANE : LANE; }

// Stages a batch of a quad, and picks the splats that reach this subgroup's tile, in their order. Returns their number, 0 where all
// pixels of the tile are closed. The ranks are sums over shuffles, since a device may lack ballots.
uint stage_batch(uint first, uint end) {
    const uint place = own_place(), own_bit = PART_SHIFT + SUBGROUP_INDEX;
    if (place < BATCH) {
        const uint instance = min(first + place, end - 1u), word = splats[slot_of(instance)];
        const uint at = RECORD_TEXELS * (word & SPLAT_BITS);
        [[unroll]] for (uint t = 0; t < RECORD_TEXELS; ++t) shared_batch[RECORD_TEXELS * place + t] = fetch(records, at + t);
        shared_words[place] = first + place < end ? word : 0u;
    }
    barrier();
    const uint reached = (open_tiles >> SUBGROUP_INDEX & 1u) << own_bit;
    uint picks = 0u;
    for (uint base = 0u; base < BATCH; base += SUBGROUP) {
        const uint picked = min(shared_words[base + LANE] & reached, 1u), upto = picks + subgroup_inclusive_sum(picked);
        if (picked != 0u) shared_picks[SUBGROUP_INDEX * BATCH + upto - 1u] = base + LANE;
        picks = subgroupShuffle(upto, SUBGROUP - 1u);
    }
    subgroupMemoryBarrierShared();
    subgroupBarrier();
    return picks;
}

// Place in the batch of the subgroup's pick j. Behind its last one: 0.
uint place_of(Loaded own, uint j) { return j < own.picks ? shared_picks[SUBGROUP_INDEX * BATCH + j] : 0u; }
uint picked_splat(Loaded own, uint j) { return shared_words[place_of(own, j)] & SPLAT_BITS; }

// Whether all pixels of the list's tiles are closed. open: whether one of this lane's is open. Behind it, what the subgroups of
// a quad have written to shared memory is there to read.
bool all_closed(bool open) {
    const bool closed = subgroupAll(!open);
    if (QUADS == 0u) return closed;
    if (LANE == 0u) shared_open[SUBGROUP_INDEX] = closed ? 0u : 1u << SUBGROUP_INDEX;
    barrier();
    open_tiles = 0u;
    [[unroll]] for (uint t = 0; t < QUAD_TILES; ++t) open_tiles |= shared_open[t];
    return open_tiles == 0u;
}

// exp(-2 (u_step^2 + v_step^2)). record1: as projected.
float ratio_step_of(vec4 record1) {
    const float u_step = record1.x * record1.y * float(ROW_STEP), v_step = record1.z * float(ROW_STEP);
    return exp(-2.0 * (u_step * u_step + v_step * v_step));
}

// Loads the batch that begins at instance `first`. Every lane of the subgroup takes part.
Loaded load_batch(uint first, uint end) {
    Loaded own;
    own.first = first;
    own.end = end;
    if (QUADS != 0u) {
        own.open = open_tiles;
        own.picks = own.turns = stage_batch(first, end);
#ifdef EWA_EMULATE_SUBGROUPS
        own.turns = BATCH;  // the subgroups of a workgroup stay together
#endif
        return own;
    }
    if (BROADCAST == BROADCAST_UNIFORM) return own;
    const uint lane = LANE;
    const uint instance = min(first + lane, end - 1u);
    const uint at = RECORD_TEXELS * splat_of(instance);
    own.record0 = first_texel(instance, at);
    own.record1 = fetch(records, at + 1u);
    own.record2 = fetch(records, at + 2u);
    own.record1.w = first + lane < end ? own.record1.w : 0.0;
    if (BROADCAST == BROADCAST_SHARED) {
        subgroupBarrier();  // the last batch has been read
        shared_batch[RECORD_TEXELS * lane] = own.record0;
        shared_batch[RECORD_TEXELS * lane + 1u] = own.record1;
        shared_batch[RECORD_TEXELS * lane + 2u] = own.record2;
        subgroupMemoryBarrierShared();
        subgroupBarrier();
    } else {
        own.ratio_step = ratio_step_of(own.record1);
    }
    return own;
}

LaneSplat lane_splat_of(vec4 record0, vec4 record1, vec4 record2, float ratio_step, vec2 pixel) {
    const float low = PARTS != 0u ? 0.0 : record0.z;
    EXACT float dx = (pixel.x - record0.x) - low;
    if (WRAP != 0u) dx -= float(push.image.size[0]) * round(dx / float(push.image.size[0]));
    EXACT const float dy = (pixel.y - record0.y) - record0.w;
    EXACT const float u = record1.x * (dx - record1.y * dy);
    LaneSplat s;
    s.u = u;
    s.u_step = -record1.x * record1.y * float(ROW_STEP);
    s.v = record1.z * dy;
    s.v_step = record1.z * float(ROW_STEP);
    s.ratio_step = ratio_step;
    s.opacity = record1.w;
    s.color = record2.rgb;
    s.z = record2.w;
    s.part = record0.z;
    return s;
}

vec4 shuffled(vec4 v, uint lane) {
    return vec4(subgroupShuffle(v.x, lane), subgroupShuffle(v.y, lane), subgroupShuffle(v.z, lane), subgroupShuffle(v.w, lane));
}

// Splat j of the batch. pixel: centre of the lane's first pixel.
LaneSplat lane_splat(Loaded own, uint j, vec2 pixel) {
    if (QUADS == 0u && BROADCAST == BROADCAST_SHUFFLES)
        return lane_splat_of(shuffled(own.record0, j), shuffled(own.record1, j), shuffled(own.record2, j),
                             subgroupShuffle(own.ratio_step, j), pixel);
    vec4 record0, record1, record2;
    if (QUADS != 0u || BROADCAST == BROADCAST_SHARED) {
        const uint place = QUADS != 0u ? place_of(own, j) : j;
        record0 = shared_batch[RECORD_TEXELS * place];
        record1 = shared_batch[RECORD_TEXELS * place + 1u];
        record2 = shared_batch[RECORD_TEXELS * place + 2u];
        if (QUADS != 0u) record1.w = j < own.picks ? record1.w : 0.0;
    } else {
        const uint instance = min(own.first + j, own.end - 1u);
        const uint at = RECORD_TEXELS * splat_of(instance);
        record0 = first_texel(instance, at);
        record1 = fetch(records, at + 1u);
        record2 = fetch(records, at + 2u);
        record1.w = own.first + j < own.end ? record1.w : 0.0;
    }
    return lane_splat_of(record0, record1, record2, BY_RATIO ? ratio_step_of(record1) : 0.0, pixel);
}

// opacity (BY_DEPTH: optical depth) times exp(-(u^2 + v^2)) at each of the lane's pixels.
void column_alphas(LaneSplat s, out float raw[PIXELS]) {
    float ratio = 0.0;
    [[unroll]] for (uint p = 0; p < PIXELS; ++p) {
        if (!BY_RATIO || p % SEGMENT == SEGMENT_BASE) {
            EXACT const float u = s.u + s.u_step * float(p), v = s.v + s.v_step * float(p), power = u * u + v * v;
            raw[p] = s.opacity * exp(-power);
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
    if (PARTS == 0u) return;
    [[unroll]] for (uint p = 0; p < PIXELS; ++p) {
        const uint x = LANE % TILE_WIDTH, y = LANE / TILE_WIDTH + p * ROW_STEP;
        raw[p] = float(y / PART_SIZE * PART_COLUMNS + x / PART_SIZE) == s.part ? raw[p] : 0.0;
    }
}

// 1 - exp(-depth) for a depth of at least zero, with all digits where it is small.
float absorbed(float depth) {
    EXACT const float far = 1.0 - exp(-depth), near = depth * (1.0 - depth / 2.0 * (1.0 - depth / 3.0 * (1.0 - depth / 4.0 *
                                                     (1.0 - depth / 5.0 * (1.0 - depth / 6.0 * (1.0 - depth / 7.0))))));
    return depth < 0.35 ? near : far;
}

// raw: opacity or, BY_DEPTH, optical depth. A NaN contributes nothing.
float alpha_of(float raw) {
    if (BY_DEPTH) return raw >= depth_of(CUT_OFF) ? min(float(ALPHA_MAX), absorbed(raw)) : 0.0;
    return raw >= CUT_OFF ? min(float(ALPHA_MAX), raw) : 0.0;
}

// T is positive while the pixel is open. It becomes negative at the splat that would have taken it to TRANSMITTANCE_STOP or
// below: one float is both value and flag.
// Returns the splat's weight alpha * T (0 if it is skipped), and updates T. alpha: as blended, before the stop.
float composite(float alpha, inout float T, out bool blended) {
    EXACT const float next = T - T * alpha;
    blended = next > float(TRANSMITTANCE_STOP);
    const float weight = blended ? alpha * T : 0.0;
    T = blended ? next : -abs(T);
    return weight;
}
#endif
