// SPDX-License-Identifier: Apache-2.0
// The opacity of a splat that is a density in space (KERNEL_DENSITY): it absorbs more along a longer chord.
// softplus(logit) is the optical depth of a sphere: 1 - exp(-softplus(logit)) = sigmoid(logit).
#ifndef EWA_LIB_DENSITY
#define EWA_LIB_DENSITY
#include "lib/near_zero.glsl"

// ln(1 + x) / x for 0 <= x <= 1; 1 at zero.
float log_1p_ratio(float x) {
    const float s = 1.0 / (2.0 + x), t = x * s, q = t * t;
    return 2.0 * s * (1.0 + q * (1.0 / 3.0 + q * (0.2 + q * (1.0 / 7.0 + q * (1.0 / 9.0 + q * (1.0 / 11.0 + q / 13.0))))));
}

float softplus(float logit) {
    const float e = exp(-abs(logit));
    return max(logit, 0.0) + e * log_1p_ratio(e);
}

// d(ln softplus)/d(logit) = sigmoid / softplus. No quotient of two tiny numbers: 1 for a very negative logit.
float log_softplus_slope(float logit) {
    const float e = exp(-abs(logit)), ratio = log_1p_ratio(e);
    return logit < 0.0 ? 1.0 / ((1.0 + e) * ratio) : 1.0 / ((1.0 + e) * (logit + e * ratio));
}

// The optical depth of an opacity.
float depth_of(float opacity) { return -log_1p(-opacity); }

// The logit with softplus(logit) = depth.
float logit_of_depth(float depth) { return depth > 20.0 ? depth : log(-exp_m1(-depth)) + depth; }

// least scale / scale: the product of the other two scales, divided by the largest such product.
vec3 pair_ratios(vec3 scale) { return min(min(scale.x, scale.y), scale.z) / scale; }

// The root mean square of the shadow over all directions, A = sqrt(((s1 s2)^2 + (s2 s3)^2 + (s3 s1)^2) / 3), times a factor
// for each of the two largest scales. No square overflows.
float mean_shadow(vec3 scale, vec2 factors) {
    const float low = min(scale.x, scale.y), high = max(scale.x, scale.y);
    const vec3 ratios = pair_ratios(scale);
    return (factors.x * max(high, scale.z)) * (factors.y * max(low, min(high, scale.z))) * sqrt(dot(ratios, ratios) / 3.0);
}

// d(ln A)/d(logarithms of the scales). Their sum is 2.
vec3 mean_shadow_slope(vec3 scale) {
    const vec3 ratios = pair_ratios(scale), squares = ratios * ratios;
    return (squares.yzx + squares.zxy) / (squares.x + squares.y + squares.z);
}
#endif
