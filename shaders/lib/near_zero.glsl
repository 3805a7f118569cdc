// SPDX-License-Identifier: Apache-2.0
// ln(1 + x) and exp(x) - 1, accurate near zero too, where drivers' log and exp have few digits left.
#ifndef EWA_LIB_NEAR_ZERO
#define EWA_LIB_NEAR_ZERO
float log_1p(float x) {   // x > -1
    const float s = x / (2.0 + x), q = s * s;
    const float series = 2.0 * s * (1.0 + q * (1.0 / 3.0 + q * (0.2 + q * (1.0 / 7.0 + q * (1.0 / 9.0 + q / 11.0)))));
    return abs(x) < 0.5 ? series : log(1.0 + x);
}
float exp_m1(float x) {   // x <= 0
    const float series =
        x * (1.0 + x / 2.0 * (1.0 + x / 3.0 * (1.0 + x / 4.0 * (1.0 + x / 5.0 * (1.0 + x / 6.0 * (1.0 + x / 7.0))))));
    return x > -0.5 ? series : exp(x) - 1.0;
}
#endif
