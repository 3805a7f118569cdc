#version 460
// SPDX-License-Identifier: Apache-2.0
// Writes one array of the next generation of splats into a new buffer. SPEC_MODE: WRITE_*.
// One invocation owns old splat i. It reads its parameters, one of its moments and its statistics, and the prefix sums of
// the outputs. It writes the parameters or the moments of what the splat becomes, side by side in the old order.
// A kept splat and a clone's original keep their moments; new splats start with zero moments. Children of a split are
// drawn from the parent's Gaussian and are SPLIT_SCALE times smaller. An even split puts them side by side
// along the longest axis, and a clone and its original share the opacity.
#extension GL_GOOGLE_include_directive : require
#include "lib/prelude.glsl"
#include "lib/params.glsl"
#include "lib/quaternion.glsl"
#include "lib/random.glsl"
#include "lib/densify.glsl"

layout(local_size_x_id = SPEC_GROUP_SIZE) in;
layout(constant_id = SPEC_SH_DEGREE) const uint SH_DEGREE = 3; // stored
layout(constant_id = SPEC_MODE) const uint MODE = 0;
TEXELS(0, params);
WORD_TEXELS(1, moments);
layout(set = 0, binding = 2, scalar) readonly buffer Statistics { vec2 statistics[]; };
layout(set = 0, binding = 3, scalar) readonly buffer Prefix { uint prefix[]; };
layout(set = 0, binding = 4, scalar) readonly buffer Totals { uint totals[]; };
layout(set = 0, binding = 5, scalar) writeonly buffer Out { uvec4 array_out[]; };
layout(push_constant, scalar) uniform Push { DensifyPush push; };

const uint PLANES = (PARAM_SH + 3 * (SH_DEGREE + 1) * (SH_DEGREE + 1) + 3) / 4;

// The first of the next generation that is splat i's.
uint offset_of(uint i) { return totals[i / push.scan_block] + prefix[i]; }

void main() {
    const uint i = item_index();
    if (i >= push.splats) return;
    vec4 p[3];
    [[unroll]] for (uint plane = 0; plane < 3; ++plane)
        p[plane] = fetch(params, param_texel(PLANES, plane, i));
    const vec4 p0 = p[0], p1 = p[1], p2 = p[2];
    const uint first = offset_of(i), end = i + 1u < push.splats ? offset_of(i + 1u) : push.new_capacity;
    // A frozen splat has one output, whatever it is like. The moments that say so may be those of the next generation already.
    const uint action = end - first == 1u ? ACTION_KEEP : action_of(push, p0, p1, p2, statistics[i], false);
    [[unroll]] for (uint child = 0; child < 2; ++child) {
        const uint to = first + child;
        const bool written = child < outputs_of(action) && to < push.new_capacity;
        const bool keeps_moments = child == 0u && action != ACTION_SPLIT;
        vec3 mean = p0.xyz, log_scale = p2.xyz;
        float logit = p0.w;
        const bool even = push.split == SPLIT_EVEN;
        if (even && action == ACTION_CLONE) logit = thinned_logit(logit, 0.5);
        if (even && action == ACTION_SPLIT) {
            float norm;
            const float longest = max(p2.x, max(p2.y, p2.z));
            const uint axis = p2.x == longest ? 0u : p2.y == longest ? 1u : 2u;
            const float side = child == 0u ? float(EVEN_OFFSET) : -float(EVEN_OFFSET);
            mean += side * exp(longest) * rotation_of(normalize_quaternion(p1, norm))[axis];
            log_scale[axis] += log(float(EVEN_SCALE));
            logit = thinned_logit(logit, float(EVEN_SHARE));
        } else if (action == ACTION_SPLIT) {
            float norm;
            const vec3 normal = normal3(uvec4(push.first + i, 2u * push.step + child, push.seed[0], push.seed[1]));
            mean += rotation_of(normalize_quaternion(p1, norm)) * (exp(p2.xyz) * normal);
            log_scale -= log(float(SPLIT_SCALE));
        }
        [[unroll]] for (uint plane = 0; plane < PLANES; ++plane) {
            const uint from = param_texel(PLANES, plane, i);
            uvec4 words = uvec4(0u);
            if (MODE == WRITE_PARAMS) {
                vec4 value = fetch(params, from);
                if (plane == 0u) value = vec4(mean, logit);
                if (plane == 2u) value.xyz = log_scale;
                words = floatBitsToUint(value);
            } else if (keeps_moments) {
                words = fetch(moments, from);
            }
            if (written) array_out[param_texel(PLANES, plane, to)] = words;
        }
    }
}
