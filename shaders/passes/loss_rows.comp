#version 460
// SPDX-License-Identifier: Apache-2.0
// Second half of the SSIM window, along the rows; then SSIM itself and its derivatives by the moments of the render:
// S = A1 A2 / (B1 B2), A1 = 2 mx my + C1, A2 = 2 (mxy - mx my) + C2, B1 = mx^2 + my^2 + C1,
// B2 = m(x^2 + y^2) - mx^2 - my^2 + C2.
// One invocation owns LOSS_TEXELS texels of channel workgroup.z; one subgroup owns one partial sum of S.
// It reads the moments, and writes the derivatives and the partial sums. Rows that are not the image's own count as zero.
#extension GL_GOOGLE_include_directive : require
#include "lib/prelude.glsl"
#include "lib/subgroup.glsl"
#include "lib/ssim.glsl"

layout(local_size_x_id = SPEC_GROUP_SIZE) in;
TEXELS(0, moments);
STORED_TEXELS(1, derivatives);
layout(set = 0, binding = 2, scalar) writeonly buffer Partials { float partials[]; };
layout(push_constant, scalar) uniform Push { LossPush push; };

void main() {
    const uint item = item_index();
    const uint row_texels = push.image.stride / 4u, plane = push.image.plane_floats / 4u, channel = gl_WorkGroupID.z;
    const uint row_items = (row_texels + LOSS_TEXELS - 1u) / LOSS_TEXELS;
    const bool inside = item < row_items * push.image.size[1];
    // Windows around other rows than the band's own belong to another band.
    const bool counts = inside && item >= row_items * push.own[0] && item < row_items * push.own[1];
    const int row = int(item / row_items) * int(row_texels), first = int(item % row_items * LOSS_TEXELS);
    vec4 m[MOMENT_PLANES][LOSS_TEXELS];
    [[unroll]] for (uint q = 0; q < MOMENT_PLANES; ++q) {
        vec4 texels[ROW_SPAN];
        [[unroll]] for (int t = 0; t < ROW_SPAN; ++t) {
            const int c = first + t - 2;
            texels[t] = fetch_or_zero(moments, inside && c >= 0 && c < int(row_texels),
                                      int((MOMENT_PLANES * channel + q) * plane) + row + c);
        }
        [[unroll]] for (int o = 0; o < int(LOSS_TEXELS); ++o) m[q][o] = blur_row(texels, o);
    }
    vec4 sums = vec4(0.0);
    [[unroll]] for (int o = 0; o < int(LOSS_TEXELS); ++o) {
        const vec4 mx = m[0][o], my = m[1][o];
        const vec4 a1 = 2.0 * mx * my + float(SSIM_C1), a2 = 2.0 * (m[3][o] - mx * my) + float(SSIM_C2);
        const vec4 mean_squares = mx * mx + my * my;
        const vec4 b1 = mean_squares + float(SSIM_C1), b2 = max(m[2][o] - mean_squares, 0.0) + float(SSIM_C2);
        const vec4 inverse = 1.0 / (b1 * b2);
        // Columns past the image's width are in the last texel and do not count.
        const uint x = 4u * uint(first + o);
        const vec4 mask = counts ? vec4(lessThan(uvec4(x, x + 1u, x + 2u, x + 3u), uvec4(push.image.size[0]))) : vec4(0.0);
        const vec4 s = mask * a1 * a2 * inverse;
        if (inside && first + o < int(row_texels)) {
            const uint at = DERIVATIVE_PLANES * channel * plane + uint(row + first + o);
            derivatives[at] = as_texel(mask * (2.0 * my * (a2 - a1) * inverse) - 2.0 * mx * s * (1.0 / b1 - 1.0 / b2));
            derivatives[at + plane] = as_texel(-s / b2);
            derivatives[at + 2u * plane] = as_texel(mask * 2.0 * a1 * inverse);
        }
        sums += s;
    }
    const float sum = subgroup_sum(sums.x + sums.y + sums.z + sums.w);
    const uint group = (gl_WorkGroupID.z * gl_NumWorkGroups.y + gl_WorkGroupID.y) * gl_NumWorkGroups.x + gl_WorkGroupID.x;
    if (LANE == 0u) partials[group * (GROUP_SIZE / SUBGROUP) + SUBGROUP_INDEX] = sum;
}
