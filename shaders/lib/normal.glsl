// SPDX-License-Identifier: Apache-2.0
// The normal distribution.
#ifndef EWA_LIB_NORMAL
#define EWA_LIB_NORMAL

// The share of a normal distribution below y standard deviations, to 5e-7 (Abramowitz and Stegun, 7.1.28, whose coefficients
// are those of y / sqrt(2)).
float normal_cdf(float y) {
    const float x = min(abs(y), 8.0);
    float p = 5.3829750e-6;
    p = p * x + 4.8890635e-5;
    p = p * x + 3.8003575e-5;
    p = p * x + 3.2776263e-3;
    p = p * x + 2.1141006e-2;
    p = p * x + 4.9867347e-2;
    p = p * x + 1.0;
    const float p2 = p * p, p4 = p2 * p2, p8 = p4 * p4, tail = 0.5 / (p8 * p8);
    return y < 0.0 ? tail : 1.0 - tail;
}

float normal_density(float y) { return 0.3989422804014327 * exp(-0.5 * y * y); }
#endif
