// SPDX-License-Identifier: Apache-2.0
// 3DGS as Markov chain Monte Carlo (Kheradmand et al. 2024, "3D Gaussian Splatting as Markov Chain Monte Carlo").
#ifndef EWA_LIB_MCMC
#define EWA_LIB_MCMC

// Opacity and factor of the scales of each of `parts` splats that stand where one of this logit stood and together
// look like it (eq. 9). The sum of that equation,
//   sum_{i=1..N} sum_{k=0..i-1} C(i-1, k) (-1)^k x^(k+1) / sqrt(k + 1)  with x the new opacity,
// cancels beyond float32 for large N. With 1 / sqrt(k) = 2 / sqrt(pi) integral exp(-k t^2) dt it is
//   2 / sqrt(pi) integral_0^inf 1 - (1 - x exp(-t^2))^N dt,
// where nothing cancels and the trapezoidal rule converges exponentially.
vec2 relocated(float logit, uint parts) {
    const float step = 0.1;
    const float optical = logit > 20.0 ? logit : log(1.0 + exp(logit)); // -ln(1 - opacity)
    const float opacity = 1.0 - exp(-optical / float(parts));
    float sum = 0.0;
    [[dont_unroll]] for (uint j = 0u; j < 42u; ++j) {
        const float t = step * float(j);
        float base = 1.0 - opacity * exp(-t * t), power = 1.0;
        [[unroll]] for (uint bit = 0u; bit < 16u; ++bit) {
            if ((parts >> bit & 1u) != 0u) power *= base;
            base *= base;
        }
        sum += j == 0u ? 0.5 * (1.0 - power) : 1.0 - power;
    }
    return vec2(opacity, (1.0 / (1.0 + exp(-logit))) / (1.1283791670955126 * step * sum));
}
#endif
