#version 460
// Second half of the SSIM window, along the rows; then SSIM itself and its derivatives by the moments of the rendering:
// S = A1 A2 / (B1 B2), A1 = 2 mx my + C1, A2 = 2 (mxy - mx my) + C2, B1 = mx^2 + my^2 + C1,
// B2 = m(x^2 + y^2) - mx^2 - my^2 + C2. One invocation owns 4 neighbouring pixels of channel workgroup.z, one subgroup
// one partial sum of S.
#extension GL_GOOGLE_include_directive : require
#include "lib/prelude.glsl"
#include "lib/subgroup.glsl"
#include "lib/ssim.glsl"

layout(local_size_x_id = SPEC_GROUP_SIZE) in;
layout(set = 0, binding = 0) uniform samplerBuffer moments;
layout(set = 0, binding = 1, scalar) writeonly buffer Derivatives { vec4 derivatives[]; };
layout(set = 0, binding = 2, scalar) writeonly buffer Partials { float partials[]; };
layout(push_constant, scalar) uniform Push { LossPush push; };

void main() {
    const uint item = item_index();
    const uint row_texels = push.stride / 4u, plane = push.plane_floats / 4u, channel = gl_WorkGroupID.z;
    const bool inside = item < row_texels * push.size[1];
    const int row = int(item / row_texels) * int(row_texels), column = int(item % row_texels);
    vec4 m[4];
    [[unroll]] for (uint q = 0; q < MOMENT_PLANES; ++q) {
        vec4 texels[5];
        [[unroll]] for (int t = 0; t < 5; ++t) {
            const int c = column + t - 2;
            const bool there = inside && c >= 0 && c < int(row_texels);
            const vec4 value = texelFetch(moments, there ? int((MOMENT_PLANES * channel + q) * plane) + row + c : 0);
            texels[t] = there ? value : vec4(0.0);
        }
        m[q] = blur_row(texels);
    }
    const vec4 mx = m[0], my = m[1];
    const vec4 a1 = 2.0 * mx * my + float(SSIM_C1), a2 = 2.0 * (m[3] - mx * my) + float(SSIM_C2);
    const vec4 mean_squares = mx * mx + my * my;
    const vec4 b1 = mean_squares + float(SSIM_C1), b2 = max(m[2] - mean_squares, 0.0) + float(SSIM_C2);
    const vec4 inverse = 1.0 / (b1 * b2);
    // Columns past the image's width stand in the last texel and count for nothing.
    const uint x = 4u * uint(column);
    const vec4 mask = inside ? vec4(lessThan(uvec4(x, x + 1u, x + 2u, x + 3u), uvec4(push.size[0]))) : vec4(0.0);
    const vec4 s = mask * a1 * a2 * inverse;
    if (inside) {
        const uint at = DERIVATIVE_PLANES * channel * plane + item;
        derivatives[at] = mask * (2.0 * my * (a2 - a1) * inverse) - 2.0 * mx * s * (1.0 / b1 - 1.0 / b2);
        derivatives[at + plane] = -s / b2;
        derivatives[at + 2u * plane] = mask * 2.0 * a1 * inverse;
    }
    const float sum = subgroup_sum(s.x + s.y + s.z + s.w);
    const uint group = (gl_WorkGroupID.z * gl_NumWorkGroups.y + gl_WorkGroupID.y) * gl_NumWorkGroups.x + gl_WorkGroupID.x;
    if (gl_SubgroupInvocationID == 0u) partials[group * (GROUP_SIZE / SUBGROUP) + gl_SubgroupID] = sum;
}
