// SPDX-License-Identifier: Apache-2.0
// The SSIM window and its blur. Images are planes of floats fetched 4 at a time; outside the image every value is zero.
#ifndef EWA_LIB_SSIM
#define EWA_LIB_SSIM
const int RADIUS = int(SSIM_RADIUS);
const float W1 = exp(-1.0 / (2.0 * SSIM_SIGMA * SSIM_SIGMA)), W2 = exp(-4.0 / (2.0 * SSIM_SIGMA * SSIM_SIGMA)),
            W3 = exp(-9.0 / (2.0 * SSIM_SIGMA * SSIM_SIGMA)), W4 = exp(-16.0 / (2.0 * SSIM_SIGMA * SSIM_SIGMA)),
            W5 = exp(-25.0 / (2.0 * SSIM_SIGMA * SSIM_SIGMA));
const float W_SUM = 1.0 + 2.0 * (W1 + W2 + W3 + W4 + W5);
// Weight of the tap at distance d.
const float WINDOW[6] = {1.0 / W_SUM, W1 / W_SUM, W2 / W_SUM, W3 / W_SUM, W4 / W_SUM, W5 / W_SUM};

// Rows that LOSS_ROWS outputs of a column read, and texels that LOSS_TEXELS outputs of a row read.
const int COLUMN_SPAN = int(LOSS_ROWS) + 2 * RADIUS;
const int ROW_SPAN = int(LOSS_TEXELS) + 4;

// Output o of a column. values[0] is RADIUS rows above output 0.
vec4 blur_column(vec4 values[COLUMN_SPAN], int o) {
    vec4 sum = WINDOW[0] * values[o + RADIUS];
    [[unroll]] for (int d = 1; d <= RADIUS; ++d)
        sum += WINDOW[d] * (values[o + RADIUS - d] + values[o + RADIUS + d]);
    return sum;
}

// Output texel o of a row. texels[0] is two texels left of output 0.
vec4 blur_row(vec4 texels[ROW_SPAN], int o) {
    vec4 result;
    [[unroll]] for (int i = 0; i < 4; ++i) {
        const int at = 4 * o + 8 + i;
        float sum = WINDOW[0] * texels[at / 4][at % 4];
        [[unroll]] for (int d = 1; d <= RADIUS; ++d)
            sum += WINDOW[d] * (texels[(at - d) / 4][(at - d) % 4] + texels[(at + d) / 4][(at + d) % 4]);
        result[i] = sum;
    }
    return result;
}

// The texel, or zero outside the image.
vec4 or_zero(bool inside, vec4 value) { return inside ? value : vec4(0.0); }
#define fetch_or_zero(SOURCE, INSIDE, AT) or_zero(INSIDE, fetch(SOURCE, (INSIDE) ? (AT) : 0))
#endif
