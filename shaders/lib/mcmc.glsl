// SPDX-License-Identifier: Apache-2.0
// 3DGS as Markov chain Monte Carlo (Kheradmand et al. 2024, "3D Gaussian Splatting as Markov Chain Monte Carlo").
#ifndef EWA_LIB_MCMC
#define EWA_LIB_MCMC
#include "lib/near_zero.glsl"

// relocated: opacity and scale factor of each of `parts` splats that replace one splat of this logit in its place and
// together look like it (eq. 9). The sum of that equation,
//   sum_{i=1..N} sum_{k=0..i-1} C(i-1, k) (-1)^k x^(k+1) / sqrt(k + 1)  with x the new opacity,
// loses all digits of float32 to cancellation for large N. With 1 / sqrt(k) = 2 / sqrt(pi) integral exp(-k t^2) dt it is
//   2 / sqrt(pi) integral_0^inf 1 - (1 - x exp(-t^2))^N dt,
// where no term cancels and the trapezoidal rule converges exponentially.
// With thousands of parts, ln(1 + x) and exp(x) - 1 are needed near zero.
vec2 relocated(float logit, uint parts) {
    const float step = 0.1;
    const float optical = logit > 20.0 ? logit : log_1p(exp(logit)); // -ln(1 - opacity)
    const float opacity = -exp_m1(-optical / float(parts));
    float sum = 0.0;
    [[dont_unroll]] for (uint j = 0u; j < 42u; ++j) {
        const float t = step * float(j);
        const float height = -exp_m1(float(parts) * log_1p(-opacity * exp(-t * t)));
        sum += j == 0u ? 0.5 * height : height;
    }
    return vec2(opacity, (1.0 / (1.0 + exp(-logit))) / (1.1283791670955126 * step * sum));
}
#endif
