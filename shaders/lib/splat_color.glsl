// SPDX-License-Identifier: Apache-2.0
// The colour of a splat that the model stores. The including pass declares SH_DEGREE, params and push, whose `planes` are
// the texel planes of a splat.
#ifndef EWA_LIB_SPLAT_COLOR
#define EWA_LIB_SPLAT_COLOR
#include "lib/params.glsl"
#include "lib/sh.glsl"

vec4 param(uint plane, uint i) { return fetch(params, param_texel(push.planes, plane, i)); }

const uint SH_FLOATS = 3 * (SH_DEGREE + 1) * (SH_DEGREE + 1);
const uint PLANES = (PARAM_SH + SH_FLOATS + 3) / 4;

// Colour seen along a direction. finite: whether it is within COLOR_MAX.
vec3 sh_color(uint i, vec4 plane2, vec3 direction, out bool finite) {
    float basis[16];
    sh_basis(SH_DEGREE, direction, basis);
    vec3 sum = vec3(0.0);
    [[unroll]] for (uint plane = PARAM_SH / 4; plane < PLANES; ++plane) {
        const vec4 value = plane == 2u ? plane2 : param(plane, i);
        [[unroll]] for (uint c = 0; c < 4; ++c) {
            const uint f = 4 * plane + c;
            if (f >= PARAM_SH && f < PARAM_SH + SH_FLOATS)
                sum[(f - PARAM_SH) % 3] += basis[(f - PARAM_SH) / 3] * value[c];
        }
    }
    // A NaN fails these comparisons.
    const vec3 size = abs(sum);
    finite = size.r <= float(COLOR_MAX) && size.g <= float(COLOR_MAX) && size.b <= float(COLOR_MAX);
    return max(vec3(0.0), sum + float(COLOR_OFFSET));
}
#endif
