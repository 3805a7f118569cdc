#version 460
// SPDX-License-Identifier: Apache-2.0
// First half of the SSIM window: blurs four moments of the render x and the target y down the columns (Wang et al.
// 2004). x^2 and y^2 are needed as a sum only.
// One invocation owns LOSS_ROWS rows of one texel of channel workgroup.z. It reads render and target,
// and writes the moments.
#extension GL_GOOGLE_include_directive : require
#include "lib/prelude.glsl"
#include "lib/ssim.glsl"

layout(local_size_x_id = SPEC_GROUP_SIZE) in;
TEXELS(0, image);
TEXELS(1, target);
STORED_TEXELS(2, moments);
layout(push_constant, scalar) uniform Push { LossPush push; };

void main() {
    const uint item = item_index();
    const uint row_texels = push.image.stride / 4u, plane = push.image.plane_floats / 4u, channel = gl_WorkGroupID.z;
    if (item >= row_texels * ((push.image.size[1] + LOSS_ROWS - 1u) / LOSS_ROWS)) return;
    const int top = int(item / row_texels * LOSS_ROWS), column = int(item % row_texels);
    vec4 a[COLUMN_SPAN], b[COLUMN_SPAN];
    [[unroll]] for (int r = 0; r < COLUMN_SPAN; ++r) {
        const int row = top + r - RADIUS;
        const bool inside = row >= 0 && row < int(push.image.size[1]);
        const int at = int(channel * plane) + row * int(row_texels) + column;
        a[r] = clamp(fetch_or_zero(image, inside, at), -float(SSIM_LIMIT), float(SSIM_LIMIT));
        b[r] = clamp(fetch_or_zero(target, inside, at), -float(SSIM_LIMIT), float(SSIM_LIMIT));
    }
    [[unroll]] for (uint q = 0; q < MOMENT_PLANES; ++q) {
        vec4 values[COLUMN_SPAN];
        [[unroll]] for (int r = 0; r < COLUMN_SPAN; ++r)
            values[r] = q == 0u ? a[r] : q == 1u ? b[r] : q == 2u ? a[r] * a[r] + b[r] * b[r] : a[r] * b[r];
        [[unroll]] for (int o = 0; o < int(LOSS_ROWS); ++o) {
            const vec4 mean = blur_column(values, o);
            if (top + o < int(push.image.size[1]))
                moments[(MOMENT_PLANES * channel + q) * plane + uint(top + o) * row_texels + uint(column)] = as_texel(mean);
        }
    }
}
