#version 460
// SPDX-License-Identifier: Apache-2.0
// The alpha of a cut-out training image as a term of the loss: the mean of |1 - T - alpha|, where T is the transmittance.
// One invocation owns LOSS_TEXELS texels of a row; one subgroup owns one partial sum of the differences.
// It reads the image planes and the training image, and writes dL/dT into dL/d(image) and the partial sums. Rows that are not
// the image's own count as zero.
#extension GL_GOOGLE_include_directive : require
#include "lib/prelude.glsl"
#include "lib/subgroup.glsl"

layout(local_size_x_id = SPEC_GROUP_SIZE) in;
COLOR_TEXELS(0, photo);
TEXELS(1, planes);
STORED_TEXELS(2, image_gradient);
layout(set = 0, binding = 3, scalar) writeonly buffer Partials { float partials[]; };
layout(push_constant, scalar) uniform Push { AlphaPush push; };

void main() {
    const uint item = item_index(), row_texels = push.image.stride / 4u;
    const uint row_items = (row_texels + LOSS_TEXELS - 1u) / LOSS_TEXELS, row = item / row_items;
    const bool own = row >= push.own[0] && row < push.own[1];
    float sum = 0.0;
    [[unroll]] for (uint o = 0; o < LOSS_TEXELS; ++o) {
        const uint texel = item % row_items * LOSS_TEXELS + o;
        if (row >= push.image.size[1] || texel >= row_texels) continue;
        const uint at = (PLANE_T * push.image.plane_floats) / 4u + row * row_texels + texel;
        const vec4 left = fetch(planes, at);
        vec4 gradient = vec4(0.0);
        [[unroll]] for (uint c = 0; c < 4u; ++c) {
            const uint x = 4u * texel + c;
            if (!own || x >= push.image.size[0]) continue;
            const float alpha = fetch_color(photo, push.first_pixel + row * push.image.size[0] + x).a;
            const float difference = 1.0 - left[c] - alpha;
            gradient[c] = -push.scale * sign(difference);
            sum += abs(difference);
        }
        image_gradient[at] = as_texel(gradient);
    }
    sum = subgroup_sum(sum);
    const uint group = gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x;
    if (LANE == 0u) partials[group * (GROUP_SIZE / SUBGROUP) + SUBGROUP_INDEX] = sum;
}
