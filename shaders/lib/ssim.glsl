// The SSIM window, and the blur of 4 neighbouring pixels along a row. Images are planes of floats fetched 4 at a time;
// what lies outside the image is zero.
#ifndef EWA_LIB_SSIM
#define EWA_LIB_SSIM
const int RADIUS = int(SSIM_RADIUS);
const float W1 = exp(-1.0 / (2.0 * SSIM_SIGMA * SSIM_SIGMA)), W2 = exp(-4.0 / (2.0 * SSIM_SIGMA * SSIM_SIGMA)),
            W3 = exp(-9.0 / (2.0 * SSIM_SIGMA * SSIM_SIGMA)), W4 = exp(-16.0 / (2.0 * SSIM_SIGMA * SSIM_SIGMA)),
            W5 = exp(-25.0 / (2.0 * SSIM_SIGMA * SSIM_SIGMA));
const float W_SUM = 1.0 + 2.0 * (W1 + W2 + W3 + W4 + W5);
// Weight of the tap at distance d.
const float WINDOW[6] = {1.0 / W_SUM, W1 / W_SUM, W2 / W_SUM, W3 / W_SUM, W4 / W_SUM, W5 / W_SUM};

// Five texels of a row, 20 pixels from 8 left of the first wanted one, to the blur of the middle four.
vec4 blur_row(vec4 texels[5]) {
    vec4 result = vec4(0.0);
    [[unroll]] for (int i = 0; i < 4; ++i) {
        [[unroll]] for (int d = -RADIUS; d <= RADIUS; ++d) {
            const int at = 8 + i + d;
            result[i] += WINDOW[abs(d)] * texels[at / 4][at % 4];
        }
    }
    return result;
}
#endif
