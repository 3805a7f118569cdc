#version 460
// SPDX-License-Identifier: Apache-2.0
// Gradient of the SSIM window, down the columns. The window is symmetric, so this is the same blur. One invocation owns
// LOSS_ROWS rows of one texel of plane workgroup.z. It reads the derivatives of SSIM and writes them blurred.
#extension GL_GOOGLE_include_directive : require
#include "lib/prelude.glsl"
#include "lib/ssim.glsl"

layout(local_size_x_id = SPEC_GROUP_SIZE) in;
TEXELS(0, derivatives);
STORED_TEXELS(1, blurred);
layout(push_constant, scalar) uniform Push { LossPush push; };

void main() {
    const uint item = item_index();
    const uint row_texels = push.image.stride / 4u, plane = gl_WorkGroupID.z * (push.image.plane_floats / 4u);
    if (item >= row_texels * ((push.image.size[1] + LOSS_ROWS - 1u) / LOSS_ROWS)) return;
    const int top = int(item / row_texels * LOSS_ROWS), column = int(item % row_texels);
    vec4 values[COLUMN_SPAN];
    [[unroll]] for (int r = 0; r < COLUMN_SPAN; ++r) {
        const int row = top + r - RADIUS;
        values[r] = fetch_or_zero(derivatives, row >= 0 && row < int(push.image.size[1]),
                                  int(plane) + row * int(row_texels) + column);
    }
    [[unroll]] for (int o = 0; o < int(LOSS_ROWS); ++o) {
        const vec4 sum = blur_column(values, o);
        if (top + o < int(push.image.size[1])) blurred[plane + uint(top + o) * row_texels + uint(column)] = as_texel(sum);
    }
}
