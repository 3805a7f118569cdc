#version 460
// Carries the derivatives of SSIM back through the window (it is symmetric: the same blur), down the columns. One
// invocation owns 4 neighbouring pixels of plane workgroup.z.
#extension GL_GOOGLE_include_directive : require
#include "lib/prelude.glsl"
#include "lib/ssim.glsl"

layout(local_size_x_id = SPEC_GROUP_SIZE) in;
layout(set = 0, binding = 0) uniform samplerBuffer derivatives;
layout(set = 0, binding = 1, scalar) writeonly buffer Blurred { vec4 blurred[]; };
layout(push_constant, scalar) uniform Push { LossPush push; };

void main() {
    const uint item = item_index();
    const uint row_texels = push.stride / 4u, plane = gl_WorkGroupID.z * (push.plane_floats / 4u);
    if (item >= row_texels * push.size[1]) return;
    const int y = int(item / row_texels), column = int(item % row_texels);
    vec4 sum = vec4(0.0);
    [[unroll]] for (int d = -RADIUS; d <= RADIUS; ++d) {
        const int row = y + d;
        const float weight = row >= 0 && row < int(push.size[1]) ? WINDOW[abs(d)] : 0.0;
        sum += weight * texelFetch(derivatives,
                                   int(plane) + clamp(row, 0, int(push.size[1]) - 1) * int(row_texels) + column);
    }
    blurred[plane + item] = sum;
}
