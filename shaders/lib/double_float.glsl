// SPDX-License-Identifier: Apache-2.0
// Sums and products of float pairs (hi, lo), about 48 bits: Dekker 1971, Knuth TAOCP 4.2.2. `precise` keeps the
// compiler from contracting or reordering the error terms. No operation relies on a fused multiply-add.
#ifndef EWA_LIB_DOUBLE_FLOAT
#define EWA_LIB_DOUBLE_FLOAT

vec2 quick_two_sum(float a, float b) {
    precise float s = a + b;
    precise float e = b - (s - a);
    return vec2(s, e);
}

vec2 two_sum(float a, float b) {
    precise float s = a + b;
    precise float bb = s - a;
    precise float e = (a - (s - bb)) + (b - bb);
    return vec2(s, e);
}

vec2 two_product(float a, float b) {
    precise float p = a * b;
    precise float ca = 4097.0 * a;
    precise float ah = ca - (ca - a);
    precise float al = a - ah;
    precise float cb = 4097.0 * b;
    precise float bh = cb - (cb - b);
    precise float bl = b - bh;
    precise float e = ((ah * bh - p) + ah * bl + al * bh) + al * bl;
    // The split overflows near FLT_MAX. The plain product is the best result there.
    return vec2(p, abs(e) <= abs(p) ? e : 0.0);
}

vec2 df_add(vec2 a, vec2 b) {
    precise vec2 s = two_sum(a.x, b.x);
    precise float e = s.y + (a.y + b.y);
    return quick_two_sum(s.x, e);
}

vec2 df_mul(vec2 a, vec2 b) {
    precise vec2 p = two_product(a.x, b.x);
    precise float e = p.y + (a.x * b.y + a.y * b.x);
    return quick_two_sum(p.x, e);
}

vec2 df_div(vec2 a, vec2 b) {
    precise float q = a.x / b.x;
    precise vec2 r = df_add(a, -df_mul(vec2(q, 0.0), b));
    return quick_two_sum(q, r.x / b.x);
}
#endif
