// SPDX-License-Identifier: Apache-2.0
// The end of a splat's update, from the gradients of its mean, opacity, quaternion, scales and first colours. The including
// pass declares what lib/adam.glsl asks for, MODE and KERNEL.
#ifndef EWA_LIB_SPLAT_UPDATE
#define EWA_LIB_SPLAT_UPDATE
const bool STATISTICS = (MODE & UPDATE_STATISTICS) != 0u, REGULARISED = (MODE & UPDATE_REGULARISED) != 0u,
           ABSOLUTE = (MODE & UPDATE_ABSOLUTE) != 0u, PACKED_MOMENTS = (MODE & UPDATE_PACKED_MOMENTS) != 0u;
#include "lib/adam.glsl"

// by_mean: and by the logit of opacity. by_scale: and by the colour in plane 2. opacity: without the kernel's factor. widest:
// the largest logarithm of a scale, with SPEC_LENSES.
void move_splat(uint i, vec4 p0, vec4 p1, vec4 p2, vec4 by_mean, vec4 by_quaternion, vec4 by_scale, float opacity, float depth,
                float widest) {
    const vec4 scale_pull = REGULARISED ? vec4(push.scale_weight * exp(p2.xyz), 0.0) : vec4(0.0);
    const vec4 opacity_pull =
        REGULARISED ? vec4(vec3(0.0), push.opacity_weight * opacity * transparency_of(p0.w)) : vec4(0.0);
    const vec4 held = LENSES != 0u ? vec4(min(p2.xyz, vec3(widest)), p2.w) : p2;
    move(2, i, held, by_scale + scale_pull, vec4(vec3(push.scale_rate), push.sh0_rate), depth);
    move(1, i, p1, by_quaternion, vec4(push.quaternion_rate), depth);
    move(0, i, p0, by_mean + opacity_pull, vec4(vec3(push.mean_rate), push.opacity_rate), depth);
}

// What the strategy reads of a view that sees the splat: the norm of its gradient, and that it was seen. half_size: px.
vec2 statistics_of(FootprintGradient f, vec2 half_size) {
    const float norm = length((ABSOLUTE ? f.absolute : f.mean) * half_size);
    return is_finite(norm) ? vec2(norm, 1.0) : vec2(0.0);
}
#endif
