// SPDX-License-Identifier: Apache-2.0
// Splats as the rays of a tile meet them. One subgroup owns one tile, and walks it in strips of ROW_STEP rows: a lane has one
// pixel of a strip.
//
// With the whitener M = S^-1 R^T, m the mean in camera coordinates, and v the ray's direction with v.z = 1, the ray is
// a + t b with a = -M m and b = M v; t is the view depth. Rotated so that b at the mean is (0, 0, |b|), and with u, v of the
// footprint without a low-pass, q = u^2 + v^2, h = 1 + g . (pixel - mean), rho = sqrt(2) / |a| and s = rho^2 q + h^2:
//   b = |b at the mean| (rho u, rho v, h)         middle, the point of the ray closest to the mean: t = z h / s
//   x, that point: sqrt(2) / s (h u, h v, -rho q)  power: -x.x / 2 = -q / s
// In these terms nothing cancels. The affine footprint is the case s = 1. Under SPEC_LENSES each splat has a pinhole of its own
// (ray_shape.glsl), and "pixel" is the ray's position in its image, the tangents.
//
// Gradient. With G = dL/d(ln depth), and S1, S2 by the borders of marching (0 without), each splat needs sums over its rays of
//   W = -G x x^T + S1 (b x^T + x b^T) + (S2 - share G) b b^T,   V = -G x + S1 b,   b of length 1
// where share is 1 for KERNEL_DENSITY: W = dL/dM M^-1, V = dL/da.
//
// Needs tile.glsl. The including pass declares rays before this file.
#ifndef EWA_LIB_RAYS
#define EWA_LIB_RAYS
#include "lib/camera.glsl"
#include "lib/lens_ray.glsl"

const float NEVER = 3.402823466e38;

struct RaySplat {
    uint at;             // its instance
    vec4 mean;           // of a lens: the unit direction to the mean and its frame_factor
    vec4 shape, bend;
    vec4 color;          // and z in the image's camera
    float along;         // |b| at the mean: sqrt(2) / (rho z)
};

struct Meeting {
    float u, v, q, h, s;
    float root;   // of s
    float depth;  // optical depth of the whole ray
    float middle; // view depth
    float stretch; // view depth over that of the splat's own camera; below 0 behind it
};

struct Ray {
    vec2 pixel;    // centre
    float norm;  // of the direction
    vec3 direction;  // under SPEC_LENSES, of unit length; 0 where the lens shows nothing
    float depth;     // of a point at distance 1
};

Ray ray_through(vec2 pixel) {
    const vec2 tangent = (pixel - vec2(camera.center_hi[0], camera.center_hi[1])) / vec2(camera.focal_hi[0], camera.focal_hi[1]);
    if (LENSES == 0u) return Ray(pixel, sqrt(1.0 + dot(tangent, tangent)), vec3(0.0), 1.0);
    const vec3 seen = lens_ray(tangent);
    const vec3 direction = seen == vec3(0.0) ? seen : normalize(seen);
    return Ray(pixel, 1.0, direction, camera.lens == LENS_BROWN ? direction.z : 1.0);
}

bool sees(Ray ray) { return LENSES == 0u || ray.direction != vec3(0.0); }

// The lane's pixel in a strip of the tile, and the strip's first row of pixel centres.
uvec2 strip_pixel(uint tile, uint strip) {
    const uint lane = LANE;
    return uvec2((tile % push.tiles[0]) * TILE_WIDTH + lane % TILE_WIDTH,
                 (tile / push.tiles[0]) * TILE_HEIGHT + lane / TILE_WIDTH + strip * ROW_STEP);
}
float strip_top(uint tile, uint strip) { return float((tile / push.tiles[0]) * TILE_HEIGHT + strip * ROW_STEP) + 0.5; }

RaySplat read_ray_splat(uint at) {
    const uint splat = splats[at];
    const vec4 bend = fetch(rays, RAY_TEXELS * splat + 2u), color = fetch(records, RECORD_TEXELS * splat + 2u);
    return RaySplat(at, fetch(rays, RAY_TEXELS * splat), fetch(rays, RAY_TEXELS * splat + 1u), bend, color,
                    1.4142135623730951 / (bend.z * color.w));
}

// The splat that lane j has.
RaySplat shared_ray_splat(RaySplat own, uint j) {
    return RaySplat(subgroupShuffle(own.at, j), shuffled(own.mean, j), shuffled(own.shape, j), shuffled(own.bend, j),
                    shuffled(own.color, j), subgroupShuffle(own.along, j));
}

// Splats that are evaluated in one unrolled block. Between blocks the lanes' splats move down by as many lanes: shuffles from
// a constant lane are fast on a CPU, and what is unrolled stays small.
#ifdef EWA_TEXEL_BUFFERS
const uint RAY_BLOCK = SUBGROUP < 8u ? SUBGROUP : 8u;
#else
const uint RAY_BLOCK = SUBGROUP < 4u ? SUBGROUP : 4u;
#endif

// Turns of all loops over splats. A driver may end an invocation's loops, silently: lavapipe does after 65,535 turns, in which it
// counts one more for each loop that ends. So they end earlier, and the host hears of it.
const uint TURNS_MOST = 50000u;
uint turns = 0u;
bool in_time() { return ++turns <= TURNS_MOST; }
void report_turns() {
    if (turns > TURNS_MOST && LANE == 0u) atomicAdd(counts.unfinished, 1u);
}

// Where a ray's direction is in the image of a splat's own camera, and the inverse of its component towards the mean.
// frame_rows in ray_shape.glsl has the frame.
vec3 lens_meeting(vec4 mean, vec3 d) {
    const float w = mean.w * (mean.x * d.x + mean.y * d.y) - d.z, s = mean.z >= 0.0 ? 1.0 : -1.0;
    const float ahead = dot(mean.xyz, d);
    const float inverse = 1.0 / (abs(ahead) < 1e-6 ? 1e-6 : ahead);
    return vec3(d.x + s * mean.x * w, s * d.y + mean.y * w, 1.0) * inverse;
}

Meeting meet(RaySplat r, Ray ray) {
    Meeting m;
    vec3 at = vec3(0.0, 0.0, 1.0);
    if (LENSES != 0u) at = lens_meeting(r.mean, ray.direction);
    EXACT const float dx = LENSES != 0u ? at.x : (ray.pixel.x - r.mean.x) - r.mean.z;
    EXACT const float dy = LENSES != 0u ? at.y : (ray.pixel.y - r.mean.y) - r.mean.w;
    const float norm = LENSES != 0u ? abs(at.z) : ray.norm;
    EXACT const float u = r.shape.x * (dx - r.shape.y * dy), v = r.shape.z * dy;
    EXACT const float q = min(u * u + v * v, 1e36);
    EXACT const float h = clamp(1.0 + (r.bend.x * dx + r.bend.y * dy), -1e18, 1e18);
    EXACT const float s = r.bend.z * r.bend.z * q + h * h;
    EXACT const float root = sqrt(s);
    EXACT const float inverse = 1.0 / s, power = -(q * inverse);
    EXACT const float depth = (KERNEL == KERNEL_DENSITY ? r.shape.w * norm * (root * inverse) : r.shape.w) * exp(power);
    EXACT float middle = r.color.w * (h * inverse);
    const float stretch = LENSES != 0u ? at.z * ray.depth : 1.0;
    if (LENSES != 0u) middle *= stretch;
    m.u = u;
    m.v = v;
    m.q = q;
    m.h = h;
    m.s = s;
    m.root = root;
    m.depth = depth;
    m.middle = middle;
    m.stretch = stretch;
    return m;
}

// Instances of the tile that the strip's rays can meet.
#ifndef CHOSEN_ROOM
#define CHOSEN_ROOM (CHOSEN_MOST + PEEK * SUBGROUP)
#endif
const uint CHOSEN_MOST = 256u;
const uint PEEK = 4u;  // lanes' worths of instances looked at together: a driver may limit the iterations
const uint PEEKED = PEEK * SUBGROUP;
shared uint chosen[CHOSEN_ROOM];

// Appends instances of [k, end) whose ellipse reaches a row of pixels between top and bottom, and whose view depths meet
// [from, to]. Stops when there are CHOSEN_MOST. Returns their number; k: the first instance that was not looked at.
uint choose(inout uint k, uint end, float top, float bottom, float from, float to) {
    subgroupBarrier();  // the last ones have been read
    uint count = 0u;
    for (; k < end; k += PEEKED) {
        if (!in_time() || count >= CHOSEN_MOST) break;
        [[unroll]] for (uint b = 0u; b < PEEK; ++b) {
            const uint at = k + b * SUBGROUP + LANE;
            const uint splat = splats[min(at, end - 1u)];
            const vec4 record0 = fetch(records, RECORD_TEXELS * splat), record1 = fetch(records, RECORD_TEXELS * splat + 1u);
            const float z = fetch(records, RECORD_TEXELS * splat + 2u).w, least = fetch(rays, RAY_TEXELS * splat + 2u).w;
            const float half_height = 1.002 / record1.z + 1e-3;
            const bool keep = at < end && top <= record0.y + half_height && bottom >= record0.y - half_height &&
                              least <= to && 2.0 * z - least >= from;
            const uint rank = subgroup_inclusive_sum(keep ? 1u : 0u);
            if (keep) chosen[count + rank - 1u] = at;
            count += subgroupShuffle(rank, SUBGROUP - 1u);
        }
    }
    subgroupMemoryBarrierShared();
    subgroupBarrier();
    return count;
}

// Before the block of chosen splats that begins at i: lane j of the block has splat i + j. Beyond the last, one whose depth is 0.
void next_block(inout RaySplat own, uint i, uint count) {
    if (i % SUBGROUP == 0u) {
        own = read_ray_splat(chosen[min(i + LANE, count - 1u)]);
        own.shape.w = i + LANE < count ? own.shape.w : 0.0;
    } else {
        own = shared_ray_splat(own, (LANE + RAY_BLOCK) % SUBGROUP);
    }
}

float subgroup_min(float x) {
    [[unroll]] for (uint s = 0u; s < DOUBLINGS; ++s) {
        if ((1u << s) < SUBGROUP) x = min(x, subgroupShuffleXor(x, 1u << s));
    }
    return x;
}

uint subgroup_min(uint x) {
    [[unroll]] for (uint s = 0u; s < DOUBLINGS; ++s) {
        if ((1u << s) < SUBGROUP) x = min(x, subgroupShuffleXor(x, 1u << s));
    }
    return x;
}
#endif
