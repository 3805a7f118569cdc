#version 460
// SPDX-License-Identifier: Apache-2.0
// Applies a training image's exposure to the render, before the loss compares the two.
// One invocation owns one pixel. It reads the render's planes and the exposure, and writes the exposed planes.
#extension GL_GOOGLE_include_directive : require
#include "lib/prelude.glsl"
#include "lib/image.glsl"
#include "lib/exposure.glsl"

layout(local_size_x_id = SPEC_GROUP_SIZE) in;
layout(set = 0, binding = 0, scalar) readonly buffer Image { float image[]; };
layout(set = 0, binding = 1, scalar) readonly buffer Exposures { vec4 exposures[]; };
layout(set = 0, binding = 2, scalar) writeonly buffer Exposed { float exposed[]; };
layout(push_constant, scalar) uniform Push { ExposurePush push; };

void main() {
    const uint i = item_index();
    if (i >= push.image.size[0] * push.image.size[1]) return;
    const uint at = pixel_offset(push.image, i), first = EXPOSURE_TEXELS * push.photo;
    const vec4 rows[3] = {exposures[first], exposures[first + 1u], exposures[first + 2u]};
    const uvec3 planes = uvec3(PLANE_R, PLANE_G, PLANE_B) * push.image.plane_floats + at;
    const vec3 color = exposed_color(rows, vec3(image[planes.r], image[planes.g], image[planes.b]));
    [[unroll]] for (uint c = 0; c < 3; ++c) exposed[planes[c]] = color[c];
}
