#version 460
// First half of the SSIM window: blurs the four moments of rendering x and photograph y down the columns (Wang et al.
// 2004; x^2 and y^2 are only ever needed as a sum). One invocation owns 4 neighbouring pixels of channel workgroup.z.
#extension GL_GOOGLE_include_directive : require
#include "lib/prelude.glsl"
#include "lib/ssim.glsl"

layout(local_size_x_id = SPEC_GROUP_SIZE) in;
layout(set = 0, binding = 0) uniform samplerBuffer image;
layout(set = 0, binding = 1) uniform samplerBuffer target;
layout(set = 0, binding = 2, scalar) writeonly buffer Moments { vec4 moments[]; };
layout(push_constant, scalar) uniform Push { LossPush push; };

void main() {
    const uint item = item_index();
    const uint row_texels = push.stride / 4u, plane = push.plane_floats / 4u, channel = gl_WorkGroupID.z;
    if (item >= row_texels * push.size[1]) return;
    const int y = int(item / row_texels), column = int(item % row_texels);
    vec4 m[4] = {vec4(0.0), vec4(0.0), vec4(0.0), vec4(0.0)};
    [[unroll]] for (int d = -RADIUS; d <= RADIUS; ++d) {
        const int row = y + d;
        const bool inside = row >= 0 && row < int(push.size[1]);
        const int at = int(channel * plane) + clamp(row, 0, int(push.size[1]) - 1) * int(row_texels) + column;
        const float weight = inside ? WINDOW[abs(d)] : 0.0;
        const vec4 a = texelFetch(image, at), b = texelFetch(target, at);
        const vec4 wa = weight * a, wb = weight * b;
        m[0] += wa;
        m[1] += wb;
        m[2] += wa * a + wb * b;
        m[3] += wa * b;
    }
    [[unroll]] for (uint q = 0; q < MOMENT_PLANES; ++q) moments[(MOMENT_PLANES * channel + q) * plane + item] = m[q];
}
