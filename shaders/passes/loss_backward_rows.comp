#version 460
// Second half of the way back, along the rows, and the gradient of the whole loss by the rendering:
// dL/dx = ssim_scale (blur dS/d(mean x) + 2 x blur dS/d(mean x^2) + y blur dS/d(mean x y)) + l1_scale sign(x - y).
// One invocation owns 4 neighbouring pixels of channel workgroup.z, one subgroup one partial sum of |x - y|.
#extension GL_GOOGLE_include_directive : require
#include "lib/prelude.glsl"
#include "lib/subgroup.glsl"
#include "lib/ssim.glsl"

layout(local_size_x_id = SPEC_GROUP_SIZE) in;
layout(set = 0, binding = 0) uniform samplerBuffer blurred;
layout(set = 0, binding = 1) uniform samplerBuffer image;
layout(set = 0, binding = 2) uniform samplerBuffer target;
layout(set = 0, binding = 3, scalar) writeonly buffer ImageGradient { vec4 image_gradient[]; };
layout(set = 0, binding = 4, scalar) writeonly buffer Partials { float partials[]; };
layout(push_constant, scalar) uniform Push { LossPush push; };

void main() {
    const uint item = item_index();
    const uint row_texels = push.stride / 4u, plane = push.plane_floats / 4u, channel = gl_WorkGroupID.z;
    const bool inside = item < row_texels * push.size[1];
    const int row = int(item / row_texels) * int(row_texels), column = int(item % row_texels);
    vec4 m[3];
    [[unroll]] for (uint q = 0; q < DERIVATIVE_PLANES; ++q) {
        vec4 texels[5];
        [[unroll]] for (int t = 0; t < 5; ++t) {
            const int c = column + t - 2;
            const bool there = inside && c >= 0 && c < int(row_texels);
            const vec4 value = texelFetch(blurred, there ? int((DERIVATIVE_PLANES * channel + q) * plane) + row + c : 0);
            texels[t] = there ? value : vec4(0.0);
        }
        m[q] = blur_row(texels);
    }
    const int at = inside ? int(channel * plane + item) : 0;
    const vec4 x = texelFetch(image, at), y = texelFetch(target, at);
    if (inside)
        image_gradient[at] = push.ssim_scale * (m[0] + 2.0 * x * m[1] + y * m[2]) + push.l1_scale * sign(x - y);
    const vec4 difference = inside ? abs(x - y) : vec4(0.0);
    const float sum = subgroup_sum(difference.x + difference.y + difference.z + difference.w);
    const uint group = (gl_WorkGroupID.z * gl_NumWorkGroups.y + gl_WorkGroupID.y) * gl_NumWorkGroups.x + gl_WorkGroupID.x;
    if (gl_SubgroupInvocationID == 0u) partials[group * (GROUP_SIZE / SUBGROUP) + gl_SubgroupID] = sum;
}
