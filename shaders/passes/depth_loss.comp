#version 460
// SPDX-License-Identifier: Apache-2.0
// The depth map of a training image as a term of the loss: the mean of |ln(S / (1 - T)) - ln d|, where S is the sum of z alpha T
// and d the map's depth. Pixels without a depth count as zero, and so do pixels whose opacity is below DEPTH_OPACITY_MIN
// and rows that are not the image's own.
// One invocation owns LOSS_TEXELS texels of a row; one subgroup owns one partial sum of the differences.
// It reads the image planes and the depth map. It writes dL/dS into dL/d(image), adds dL/dT, and writes the partial sums.
#extension GL_GOOGLE_include_directive : require
#include "lib/prelude.glsl"
#include "lib/subgroup.glsl"

layout(local_size_x_id = SPEC_GROUP_SIZE) in;
TEXELS(0, planes);
layout(set = 0, binding = 1, scalar) readonly buffer Depths { float depths[]; };
layout(set = 0, binding = 2, scalar) buffer ImageGradient { float image_gradient[]; };
layout(set = 0, binding = 3, scalar) writeonly buffer Partials { float partials[]; };
layout(push_constant, scalar) uniform Push { DepthPush push; };

void main() {
    const uint item = item_index(), row_texels = push.image.stride / 4u;
    const uint row_items = (row_texels + LOSS_TEXELS - 1u) / LOSS_TEXELS, row = item / row_items;
    const bool own = row >= push.own[0] && row < push.own[1];
    float sum = 0.0;
    [[unroll]] for (uint o = 0; o < LOSS_TEXELS; ++o) {
        const uint texel = item % row_items * LOSS_TEXELS + o;
        if (row >= push.image.size[1] || texel >= row_texels) continue;
        const uint at = row * push.image.stride + 4u * texel;
        const vec4 left = fetch(planes, (PLANE_T * push.image.plane_floats + at) / 4u);
        const vec4 sums = fetch(planes, (PLANE_DEPTH * push.image.plane_floats + at) / 4u);
        [[unroll]] for (uint c = 0; c < 4u; ++c) {
            const uint x = 4u * texel + c;
            const float depth = own && x < push.image.size[0] ? depths[push.first_pixel + row * push.image.size[0] + x] : 0.0;
            const float opacity = 1.0 - left[c];
            float slope = 0.0;
            if (depth > 0.0 && opacity >= float(DEPTH_OPACITY_MIN)) {
                const float difference = log(sums[c] / (opacity * depth));
                slope = push.scale * sign(difference);
                sum += abs(difference);
            }
            image_gradient[PLANE_DEPTH * push.image.plane_floats + at + c] = slope == 0.0 ? 0.0 : slope / sums[c];
            if (slope != 0.0) image_gradient[PLANE_T * push.image.plane_floats + at + c] += slope / opacity;
        }
    }
    sum = subgroup_sum(sum);
    const uint group = gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x;
    if (LANE == 0u) partials[group * (GROUP_SIZE / SUBGROUP) + SUBGROUP_INDEX] = sum;
}
