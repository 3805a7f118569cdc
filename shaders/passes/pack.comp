#version 460
// SPDX-License-Identifier: Apache-2.0
// Packs the planes of an image into words, pixel after pixel in rows of `stride` pixels. Bytes are rounded and clamped as
// save_image does. One invocation owns one texel of each plane, which is 4 pixels of a row. It reads the planes and writes the
// packed words. SPEC_MODE: PACK_*.
#extension GL_GOOGLE_include_directive : require
#include "lib/prelude.glsl"

layout(local_size_x_id = SPEC_GROUP_SIZE) in;
layout(constant_id = SPEC_MODE) const uint MODE = 0;
TEXELS(0, planes);
layout(set = 0, binding = 1, scalar) writeonly buffer Packed { uint packed[]; };
layout(push_constant, scalar) uniform Push { PackPush push; };

// NaN becomes 0.
uvec4 to_byte(vec4 v) {
    precise const vec4 scaled = mix(vec4(0.0), min(v, vec4(1.0)), greaterThan(v, vec4(0.0))) * 255.0;
    return uvec4(scaled + 0.5);
}

void main() {
    const uint i = item_index(), texels = push.plane_floats / 4u;
    if (i >= texels) return;
    const vec4 alpha = MODE == PACK_OPAQUE ? vec4(1.0) : 1.0 - fetch(planes, PLANE_T * texels + i);
    if (MODE == PACK_DEPTH) {
        const vec4 depth = fetch(planes, PLANE_DEPTH * texels + i);
        for (uint p = 0; p < 4; ++p)
            packed[4 * i + p] = floatBitsToUint(alpha[p] > 0.0 ? depth[p] / alpha[p] : depth[p]);
        return;
    }
    const vec4 r = fetch(planes, PLANE_R * texels + i);
    const vec4 g = fetch(planes, PLANE_G * texels + i);
    const vec4 b = fetch(planes, PLANE_B * texels + i);
    if (MODE == PACK_FLOATS) {
        for (uint p = 0; p < 4; ++p) {
            const uvec4 pixel = floatBitsToUint(vec4(r[p], g[p], b[p], alpha[p]));
            for (uint c = 0; c < 4; ++c) packed[16 * i + 4 * p + c] = pixel[c];
        }
        return;
    }
    const uvec4 words = to_byte(r) | (to_byte(g) << 8) | (to_byte(b) << 16) | (to_byte(alpha) << 24);
    for (uint p = 0; p < 4; ++p) packed[4 * i + p] = words[p];
}
