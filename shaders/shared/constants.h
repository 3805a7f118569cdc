// SPDX-License-Identifier: Apache-2.0
// Every constant of the rendering model, defined once for the shaders, the host and the CPU reference.
// Values are those of gsplat 1.6 unless a line says otherwise.
#ifndef EWA_SHARED_CONSTANTS_H
#define EWA_SHARED_CONSTANTS_H
#include "glue.h"
EWA_BEGIN_SHARED

// Projection.
EWA_REAL(NEAR_PLANE, 0.01);           // a splat is visible only where view z > NEAR_PLANE (world units)
EWA_REAL(MEDIAN_TRANSMITTANCE, 0.5);  // the median depth is where T first falls to it
EWA_REAL(LOW_PASS, 0.3);              // added to both diagonal entries of the 2D covariance (px^2)
EWA_REAL(LOW_PASS_ANTIALIAS,
         0.1);  // the same with KERNEL_ANTIALIAS: Mip-Splatting's, about the width of a pixel
// A splat that exceeds one of the next three is skipped and counted.
EWA_REAL(VIEW_MAX, 1e18);       // distance of the mean from the camera along each axis (world units)
EWA_REAL(FOOTPRINT_MAX, 1e18);  // sum of the six entries of M = J W R S (px)
EWA_REAL(COLOR_MAX, 1e30);      // each colour channel
// A quaternion whose components are all smaller counts as zero.
EWA_REAL(QUATERNION_MIN, 1.1754943508222875e-38);
EWA_REAL(JACOBIAN_MARGIN, 0.3);  // x/z in J is clamped to this share of the half image beyond each border

// A rolling shutter. Beyond READOUT_MARGIN of the image's side outside of it, the camera is at rest.
EWA_REAL(READOUT_TURN_MAX, 1.58);      // radians from the first row to the last
EWA_REAL(READOUT_TURN_LEARNED, 1.57);  // the same, of a motion that training learns
EWA_REAL(READOUT_MARGIN, 0.15);
EWA_UINT(READOUT_VIEWS, 8u);  // that find the time of a splat's row, by Newton's method from one to the next
EWA_REAL(READOUT_RATE_MIN, 0.1);   // a splat that almost keeps up with the readout has no sharp image
EWA_REAL(READOUT_RESIDUAL, 1e-3);  // of that time, which is 1 at the last row

// Compositing.
EWA_REAL(ALPHA_MAX, 0.99);         // alpha = min(ALPHA_MAX, opacity * exp(power))
EWA_REAL(ALPHA_MIN, 1.0 / 255.0);  // a contribution below this is skipped
// Blending stops before the splat that would take T to this or below.
EWA_REAL(TRANSMITTANCE_STOP, 1e-4);

// Marching along rays.
EWA_REAL(MARCH_DEPTH_MIN, 1e-5);  // a smaller optical depth of the whole ray is skipped
EWA_REAL(MARCH_STOP, 1e-7);       // behind this transmittance, intervals need not be evaluated
EWA_REAL(MARCH_BIN_REACH, 3.0);   // standard deviations along a ray, of the first look at it
EWA_UINT(MARCH_BINS, 32u);        // of the first look at a ray, by which its intervals are placed

// Splats drawn as solids, for a look at the structure of a scene.
EWA_REAL(ELLIPSOID_REACH, 2.0);    // radius in standard deviations
EWA_REAL(ELLIPSOID_OPACITY, 0.1);  // splats of a lower opacity are not drawn
EWA_REAL(ELLIPSOID_RIM, 0.35);     // shade at the outline; 1 in the middle

// Splats with marks. Red and the accent (1, MARK_ACCENT_GREEN, MARK_ACCENT_BLUE) take this share of a colour.
EWA_REAL(MARK_SHARE, 0.65);
EWA_REAL(MARK_ACCENT_GREEN, 0.7);
EWA_REAL(MARK_ACCENT_BLUE, 0.1);
EWA_REAL(MARK_LOCKED_LIGHT, 0.45);  // factor of the colours of locked splats

// Real spherical harmonics in INRIA's order and signs (3DGS, utils/sh_utils.py; Sloan 2013).
EWA_REAL(SH_C0, 0.28209479177387814);
EWA_REAL(SH_C1, 0.4886025119029199);
EWA_REAL(SH_C2_0, 1.0925484305920792);
EWA_REAL(SH_C2_1, -1.0925484305920792);
EWA_REAL(SH_C2_2, 0.31539156525252005);
EWA_REAL(SH_C2_3, -1.0925484305920792);
EWA_REAL(SH_C2_4, 0.5462742152960396);
EWA_REAL(SH_C3_0, -0.5900435899266435);
EWA_REAL(SH_C3_1, 2.890611442640554);
EWA_REAL(SH_C3_2, -0.4570457994644658);
EWA_REAL(SH_C3_3, 0.3731763325901154);
EWA_REAL(SH_C3_4, -0.4570457994644658);
EWA_REAL(SH_C3_5, 1.445305721320277);
EWA_REAL(SH_C3_6, -0.5900435899266435);
// Degree 4, which the operators have and the trainer has not.
EWA_REAL(SH_C4_0, 2.5033429417967046);
EWA_REAL(SH_C4_1, -1.7701307697799304);
EWA_REAL(SH_C4_2, 0.9461746957575601);
EWA_REAL(SH_C4_3, -0.6690465435572892);
EWA_REAL(SH_C4_4, 0.10578554691520431);
EWA_REAL(SH_C4_5, -0.6690465435572892);
EWA_REAL(SH_C4_6, 0.47308734787878004);
EWA_REAL(SH_C4_7, -1.7701307697799304);
EWA_REAL(SH_C4_8, 0.6258357354491761);
EWA_REAL(COLOR_OFFSET, 0.5);  // colour = max(0, SH sum + COLOR_OFFSET)

// The operators of projection, as gsplat 1.6 has them.
EWA_REAL(RADIUS_SIGMAS, 3.33);       // a radius is at most this many standard deviations
EWA_REAL(RADIUS_MAX, 1073741824.0);  // px
// A smaller compensation has no gradient: ratios of the determinants would leave float32.
EWA_REAL(COMPENSATION_MIN, 1e-12);
// A smaller scale counts as this, so that gradients are finite.
EWA_REAL(SCALE_MIN, 1e-30);

// SSIM, for images in [0, 1]. include/ewa/loss_weights.h has the loss.
EWA_REAL(SSIM_C1, 0.01 * 0.01);
EWA_REAL(SSIM_C2, 0.03 * 0.03);
// SSIM clamps values to this, and squares of larger differences grow linearly: digits are left for SSIM_C2.
EWA_REAL(SSIM_LIMIT, 16.0);
// Pixels of a lower opacity have no mean depth that could be compared with a depth map.
EWA_REAL(DEPTH_OPACITY_MIN, 0.1);
EWA_REAL(SSIM_SIGMA, 1.5);  // standard deviation of the window (px)
EWA_UINT(SSIM_RADIUS, 5u);  // window of 2 * SSIM_RADIUS + 1 taps, zero padded

// Adam (Kingma and Ba 2015), with the epsilon of 3DGS.
EWA_REAL(ADAM_BETA1, 0.9);
EWA_REAL(ADAM_BETA2, 0.999);
EWA_REAL(ADAM_EPSILON, 1e-15);
// Larger gradients are clamped to this. Adam's step does not depend on the gradient's size.
EWA_REAL(GRADIENT_MAX, 1e18);

// Longest step of the optimiser (docs/numerics.md, "Steps").
EWA_REAL(STEP_DEPTH_SHARE, 0.5);  // a mean moves by at most this share of its depth in the view
EWA_REAL(STEP_NORM_SHARE, 0.5);   // a quaternion moves by at most this share of its norm
// A step keeps the logarithm of a scale in this range, which is 1e-30 to 1e18 world units.
EWA_REAL(LOG_SCALE_MIN, -69.0);
EWA_REAL(LOG_SCALE_MAX, 41.0);
// Through a fisheye or 360 degrees, a step keeps the scales of a splat below this share of its distance.
EWA_REAL(WIDEST_SHARE, 0.125);

// Adaptive density control (3DGS, section 5.2 and its published code).
EWA_REAL(SPLIT_SCALE, 1.6);  // a split child's scales are the parent's divided by this
// What a clone and a split leave (DensifyPush). Drawn: children of a split are drawn from their parent, as opaque as it. Even: the
// picture stays as it was, nearly.
EWA_UINT(SPLIT_DRAWN, 0u);
EWA_UINT(SPLIT_EVEN, 1u);
// An even split puts two children at half a standard deviation on both sides along the longest axis. With this factor of that axis
// they have the parent's second moment: 0.5^2 + factor^2 = 1. With this power of the transmittance they have its optical thickness.
EWA_REAL(EVEN_OFFSET, 0.5);
EWA_REAL(EVEN_SCALE, 0.8660254037844386);
EWA_REAL(EVEN_SHARE, 0.5773502691896258);  // 1 / (2 EVEN_SCALE)

// 3DGS as Markov chain Monte Carlo (Kheradmand et al. 2024, and its published code).
// Noise is multiplied by sigmoid(-slope (opacity - gate opacity)).
EWA_REAL(MCMC_GATE_SLOPE, 100.0);
EWA_REAL(MCMC_GATE_OPACITY, 0.005);
// Each use of random numbers has its own stream.
EWA_UINT(MCMC_DRAW_STREAM, 0x64726177u);
EWA_UINT(MCMC_NOISE_STREAM, 0x6e6f6973u);
EWA_UINT(MCMC_SPREAD_STREAM, 0x73707264u);
EWA_UINT(MOMENT_STREAM, 0x6d6f6d00u);  // plus the plane: rounding of Adam's moments
// Each word of the moments of a frozen splat. Adam writes finite moments, and this is NaN, in 32 bits and in 16.
EWA_UINT(FROZEN_MOMENT, 0xffffffffu);

// How a splat's opacity depends on its footprint. Values of SPEC_KERNEL and of ewa::Footprint.
// 3DGS: the opacity is the peak of the footprint.
EWA_UINT(KERNEL_PEAK, 0u);
// Mip-Splatting (Yu et al. 2024, eq. 9): times sqrt(det before / det after low-pass).
EWA_UINT(KERNEL_ANTIALIAS, 1u);
// EWA (Zwicker et al. 2001): a density in space, which absorbs more along a longer chord.
EWA_UINT(KERNEL_DENSITY, 2u);
// A larger optical depth at the middle of a density's footprint counts as this.
EWA_REAL(DEPTH_MAX, 1e4);

// Appearance of a training image: the physically plausible signal processor of a camera (PPISP, 2026).
// Offsets of the colour targets are latent offsets times a symmetric 2x2 matrix (XX XY; XY YY) each.
EWA_REAL(PPISP_BLUE_XX, 0.0480542);
EWA_REAL(PPISP_BLUE_XY, -0.0043631);
EWA_REAL(PPISP_BLUE_YY, 0.0481283);
EWA_REAL(PPISP_RED_XX, 0.0580570);
EWA_REAL(PPISP_RED_XY, -0.0179872);
EWA_REAL(PPISP_RED_YY, 0.0431061);
EWA_REAL(PPISP_GREEN_XX, 0.0433336);
EWA_REAL(PPISP_GREEN_XY, -0.0180537);
EWA_REAL(PPISP_GREEN_YY, 0.0580500);
EWA_REAL(PPISP_GREY_XX, 0.0128369);
EWA_REAL(PPISP_GREY_XY, -0.0034654);
EWA_REAL(PPISP_GREY_YY, 0.0128158);
EWA_REAL(PPISP_INTENSITY_MIN, 1e-5);  // added to the intensity that the colours are divided by
EWA_REAL(PPISP_CURVE_MIN, 0.3);       // least exponent of a response's toe and shoulder
EWA_REAL(PPISP_GAMMA_MIN, 0.1);
EWA_REAL(PPISP_BASE_MIN, 1e-6);  // least base of a power
// Its penalties: smooth L1 of the mean exposure and of the mean offsets, which is quadratic below BETA. The others are means
// over the values of a camera: squared distance of the vignette's centre, rises of the vignette, variance over the channels.
EWA_REAL(PPISP_EXPOSURE_BETA, 0.1);
EWA_REAL(PPISP_COLOR_BETA, 0.005);
EWA_REAL(PPISP_CENTER_WEIGHT, 0.02);
EWA_REAL(PPISP_RISE_WEIGHT, 0.01);
EWA_REAL(PPISP_CHANNEL_WEIGHT, 0.1);

// Appearance of a training image: a bilateral grid of affine maps (Chen et al. 2007; Wang et al. 2024).
EWA_UINT(GRID_WIDTH, 16u);   // cells along x
EWA_UINT(GRID_HEIGHT, 16u);  // along y
EWA_UINT(GRID_DEPTH, 8u);    // along grey
EWA_REAL(GREY_RED, 0.299);
EWA_REAL(GREY_GREEN, 0.587);
EWA_REAL(GREY_BLUE, 0.114);
EWA_REAL(GRID_VARIATION_WEIGHT, 10.0);  // of the mean squared differences along the three axes

// The sky: light from infinitely far, a map of texels over an octahedron (lib/sky.glsl).
EWA_UINT(SKY_BLOCK, 8u);   // px a side of a block, for the gradient
EWA_REAL(SKY_PULL, 1e-6);  // d(loss)/d(texel) for a neighbour that differs by 1
// Gradients are added as whole multiples of 1 / SKY_UNITS. A pixel has at most SKY_SUM_MAX of an image's pixels: then no sum
// overflows. dL/d(colour) of L1 is 1.07e8 / pixels of them.
EWA_REAL(SKY_UNITS, 402653184.0);
EWA_REAL(SKY_SUM_MAX, 1073741824.0);

// The path tracer of mesh scenes (docs/meshes.md describes its model).
EWA_UINT(TRACE_STACK, 48u);         // greatest depth of the hierarchy: children on the stack of a ray
EWA_UINT(TRACE_LEAF_MAX, 4u);       // triangles a leaf
EWA_UINT(TRACE_BOUNCES, 5u);        // most bounces of a path
EWA_UINT(TRACE_ROULETTE, 2u);       // first bounce at which Russian roulette may end a path
EWA_REAL(TRACE_ALPHA_MIN, 0.0025);  // least GGX width (roughness^2): mirrors are this rough
EWA_REAL(TRACE_SAMPLE_MAX, 2.0);    // samples are clamped to this many times white
EWA_REAL(DEPTH_ALPHA, 0.5);         // depth sees blended surfaces of at least this opacity

EWA_END_SHARED
#endif
