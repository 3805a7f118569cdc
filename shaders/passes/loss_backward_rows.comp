#version 460
// SPDX-License-Identifier: Apache-2.0
// Gradient of the SSIM window along the rows, and the gradient of the whole loss by the render x:
// dL/dx = ssim_scale (blur dS/d(mean x) + 2 x blur dS/d(mean x^2) + y blur dS/d(mean x y)) + l1_scale sign(x - y)
//         + 2 l2_scale clamp(x - y).
// The first term needs LOSS_SSIM and applies where |x| is within SSIM_LIMIT. The others apply in the image's own rows, the
// last one with LOSS_SQUARES. It clamps to SSIM_LIMIT: a square (x - y)^2 grows linearly from there.
// One invocation owns LOSS_TEXELS texels of channel workgroup.z; one subgroup owns one partial sum of |x - y|
// and, in the next row, one of (x - y)^2 with both clamped to [0, 1]. With LOSS_SQUARES another row has (x - y)^2.
// With LOSS_SSIM these rows follow the one of loss_rows.comp.
// SPEC_MODE: LOSS_* bits.
// It reads the blurred derivatives, the render and the target, and writes dL/d(image) and the partial sums.
#extension GL_GOOGLE_include_directive : require
#include "lib/prelude.glsl"
#include "lib/subgroup.glsl"
#include "lib/ssim.glsl"

layout(local_size_x_id = SPEC_GROUP_SIZE) in;
layout(constant_id = SPEC_MODE) const uint MODE = LOSS_SSIM;
const bool SIMILARITY = (MODE & LOSS_SSIM) != 0u, SQUARES = (MODE & LOSS_SQUARES) != 0u;
TEXELS(0, blurred);
TEXELS(1, image);
TEXELS(2, target);
STORED_TEXELS(3, image_gradient);
layout(set = 0, binding = 4, scalar) writeonly buffer Partials { float partials[]; };
layout(push_constant, scalar) uniform Push { LossPush push; };

void main() {
    const uint item = item_index();
    const uint row_texels = push.image.stride / 4u, plane = push.image.plane_floats / 4u, channel = gl_WorkGroupID.z;
    const uint row_items = (row_texels + LOSS_TEXELS - 1u) / LOSS_TEXELS;
    const bool inside = item < row_items * push.image.size[1];
    // Differences in other rows than the band's own belong to another band.
    const bool counts = inside && item >= row_items * push.own[0] && item < row_items * push.own[1];
    const float l1_scale = counts ? push.l1_scale : 0.0, l2_scale = counts ? push.l2_scale : 0.0;
    const int row = int(item / row_items) * int(row_texels), first = int(item % row_items * LOSS_TEXELS);
    vec4 m[DERIVATIVE_PLANES][LOSS_TEXELS];
    if (SIMILARITY) [[unroll]] for (uint q = 0; q < DERIVATIVE_PLANES; ++q) {
        vec4 texels[ROW_SPAN];
        [[unroll]] for (int t = 0; t < ROW_SPAN; ++t) {
            const int c = first + t - 2;
            texels[t] = fetch_or_zero(blurred, inside && c >= 0 && c < int(row_texels),
                                      int((DERIVATIVE_PLANES * channel + q) * plane) + row + c);
        }
        [[unroll]] for (int o = 0; o < int(LOSS_TEXELS); ++o) m[q][o] = blur_row(texels, o);
    }
    vec4 differences = vec4(0.0), shown_squares = vec4(0.0), squares = vec4(0.0);
    [[unroll]] for (int o = 0; o < int(LOSS_TEXELS); ++o) {
        const bool there = inside && first + o < int(row_texels);
        const int at = int(channel * plane) + row + first + o;
        const vec4 x = fetch_or_zero(image, there, at), y = fetch_or_zero(target, there, at);
        vec4 gradient = l1_scale * sign(x - y);
        if (SIMILARITY) {
            const vec4 limit = vec4(SSIM_LIMIT), seen = vec4(lessThanEqual(abs(x), limit));
            gradient = push.ssim_scale * seen * (m[0][o] + 2.0 * clamp(x, -limit, limit) * m[1][o] +
                                                 clamp(y, -limit, limit) * m[2][o]) + gradient;
        }
        if (SQUARES) {
            const vec4 size = min(abs(x - y), vec4(SSIM_LIMIT));
            gradient += 2.0 * l2_scale * size * sign(x - y);
            squares += size * (2.0 * abs(x - y) - size);
        }
        if (there) image_gradient[at] = as_texel(gradient);
        differences += abs(x - y);
        const vec4 shown = clamp(x, 0.0, 1.0) - clamp(y, 0.0, 1.0);
        shown_squares += shown * shown;
    }
    const float sum = subgroup_sum(counts ? differences.x + differences.y + differences.z + differences.w : 0.0);
    const float shown_sum =
        subgroup_sum(counts ? shown_squares.x + shown_squares.y + shown_squares.z + shown_squares.w : 0.0);
    const float square_sum =
        SQUARES ? subgroup_sum(counts ? squares.x + squares.y + squares.z + squares.w : 0.0) : 0.0;
    const uint group = (gl_WorkGroupID.z * gl_NumWorkGroups.y + gl_WorkGroupID.y) * gl_NumWorkGroups.x + gl_WorkGroupID.x;
    if (LANE != 0u) return;
    const uint row_sums = gl_NumWorkGroups.x * gl_NumWorkGroups.y * gl_NumWorkGroups.z * (GROUP_SIZE / SUBGROUP);
    const uint at = (SIMILARITY ? row_sums : 0u) + group * (GROUP_SIZE / SUBGROUP) + SUBGROUP_INDEX;
    partials[at] = sum;
    partials[row_sums + at] = shown_sum;
    if (SQUARES) partials[2u * row_sums + at] = square_sum;
}
