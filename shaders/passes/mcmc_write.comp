#version 460
// SPDX-License-Identifier: Apache-2.0
// Writes one array of the next generation of splats into a new buffer. SPEC_MODE: WRITE_*.
// One invocation owns new splat j. It reads the parameters and one of the moments of splat j or of its source, and writes
// the parameters or the moments of splat j. A dead splat, and one beyond the old number, becomes a copy of its source. A source and its copies share
// what the source was (lib/mcmc.glsl; optical depths just add up) and start with zero moments. With a spread, each is placed by a normal draw
// of the source's Gaussian.
#extension GL_GOOGLE_include_directive : require
#include "lib/prelude.glsl"
#include "lib/params.glsl"
#include "lib/density.glsl"
#include "lib/mcmc.glsl"
#include "lib/quaternion.glsl"
#include "lib/random.glsl"

layout(local_size_x_id = SPEC_GROUP_SIZE) in;
layout(constant_id = SPEC_SH_DEGREE) const uint SH_DEGREE = 3; // stored
layout(constant_id = SPEC_KERNEL) const uint KERNEL = KERNEL_PEAK;
layout(constant_id = SPEC_MODE) const uint MODE = 0;
TEXELS(0, params);
WORD_TEXELS(1, moments);
layout(set = 0, binding = 2, scalar) readonly buffer Dead { uint dead[]; };
layout(set = 0, binding = 3, scalar) readonly buffer Prefix { uint prefix[]; }; // of dead
layout(set = 0, binding = 4, scalar) readonly buffer Totals { uint totals[]; };
layout(set = 0, binding = 5, scalar) readonly buffer Sources { uint sources[]; };
layout(set = 0, binding = 6, scalar) readonly buffer Hits { uint hits[]; };
layout(set = 0, binding = 7, scalar) writeonly buffer Out { uvec4 array_out[]; };
layout(push_constant, scalar) uniform Push { McmcPush push; };

const uint PLANES = (PARAM_SH + 3 * (SH_DEGREE + 1) * (SH_DEGREE + 1) + 3) / 4;

void main() {
    const uint j = item_index();
    if (j >= push.new_splats) return;
    uint source = j;
    if (j >= push.splats) source = sources[push.dead + j - push.splats];
    else if (dead[j] != 0u) source = sources[totals[j / push.scan_block] + prefix[j]];
    const uint copies = hits[source];
    const float logit = fetch(params, param_texel(PLANES, 0u, source)).w;
    float shared_logit, factor;
    if (KERNEL == KERNEL_DENSITY) {
        shared_logit = logit_of_depth(max(softplus(logit) / float(copies + 1u), depth_of(push.least_opacity)));
        factor = 1.0;
    } else {
        const vec2 part = relocated(logit, copies + 1u);
        const float opacity = clamp(part.x, push.least_opacity, 1.0 - 1e-6);
        shared_logit = log(opacity / (1.0 - opacity));
        factor = part.y;
    }
    vec3 offset = vec3(0.0);
    if (push.spread > 0.0) {
        float norm;
        const vec3 normal = normal3(uvec4(push.first + j, push.step, push.seed[0], push.seed[1] ^ MCMC_SPREAD_STREAM));
        const vec3 scale = exp(fetch(params, param_texel(PLANES, 2u, source)).xyz);
        const mat3 rotation = rotation_of(normalize_quaternion(fetch(params, param_texel(PLANES, 1u, source)), norm));
        offset = push.spread * (rotation * (scale * normal));
    }
    [[unroll]] for (uint plane = 0; plane < PLANES; ++plane) {
        const uint from = param_texel(PLANES, plane, source);
        uvec4 words = uvec4(0u);
        if (MODE == WRITE_PARAMS) {
            vec4 value = fetch(params, from);
            if (plane == 0u && copies > 0u) value = vec4(value.xyz + offset, shared_logit);
            if (plane == 2u && copies > 0u) value.xyz += log(factor);
            words = floatBitsToUint(value);
        } else if (copies == 0u) {
            words = fetch(moments, from);
        }
        array_out[param_texel(PLANES, plane, j)] = words;
    }
}
