#version 460
// SPDX-License-Identifier: Apache-2.0
// Gradient of expose. dL/d(render) is the transposed matrix times dL/d(exposed render); dL/d(exposure) is summed over
// pixels. One workgroup is one subgroup and owns EXPOSURE_BLOCK pixels. It reads the render and the exposure, updates
// dL/d(image) in place, and writes its block's partial sums of dL/d(exposure).
#extension GL_GOOGLE_include_directive : require
#include "lib/prelude.glsl"
#include "lib/image.glsl"
#include "lib/subgroup.glsl"
#include "lib/exposure.glsl"

layout(local_size_x_id = SPEC_GROUP_SIZE) in;
layout(set = 0, binding = 0, scalar) readonly buffer Image { float image[]; };
layout(set = 0, binding = 1, scalar) readonly buffer Exposures { vec4 exposures[]; };
layout(set = 0, binding = 2, scalar) buffer ImageGradient { float image_gradient[]; };
layout(set = 0, binding = 3, scalar) writeonly buffer Sums { vec4 sums[]; };
layout(push_constant, scalar) uniform Push { ExposurePush push; };

void main() {
    const uint block = gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x;
    const uint pixels = push.image.size[0] * push.image.size[1];
    const uint begin = block * EXPOSURE_BLOCK, end = min(begin + EXPOSURE_BLOCK, pixels);
    if (begin >= pixels) return;
    const uint first = EXPOSURE_TEXELS * push.photo;
    const vec3 matrix_rows[3] = {exposures[first].xyz, exposures[first + 1u].xyz, exposures[first + 2u].xyz};
    vec4 sum[3] = {vec4(0.0), vec4(0.0), vec4(0.0)};
    for (uint i = begin + LANE; i < end; i += SUBGROUP) {
        const uint at = pixel_offset(push.image, i);
        const uvec3 planes = uvec3(PLANE_R, PLANE_G, PLANE_B) * push.image.plane_floats + at;
        const vec4 color = vec4(image[planes.r], image[planes.g], image[planes.b], 1.0);
        const vec3 gradient = vec3(image_gradient[planes.r], image_gradient[planes.g], image_gradient[planes.b]);
        vec3 back = vec3(0.0);
        [[unroll]] for (uint c = 0; c < 3; ++c) {
            back += gradient[c] * matrix_rows[c];
            sum[c] += gradient[c] * color;
        }
        [[unroll]] for (uint c = 0; c < 3; ++c) image_gradient[planes[c]] = back[c];
    }
    [[unroll]] for (uint c = 0; c < 3; ++c) {
        const vec4 total = vec4(subgroup_sum(sum[c].x), subgroup_sum(sum[c].y), subgroup_sum(sum[c].z), subgroup_sum(sum[c].w));
        if (LANE == 0u) sums[EXPOSURE_TEXELS * block + c] = total;
    }
}
