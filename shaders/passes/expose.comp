#version 460
// SPDX-License-Identifier: Apache-2.0
// Applies a training image's exposure to the render, before the loss compares the two.
// One invocation owns one pixel. It reads the render's planes and the exposure, and writes the exposed planes.
#extension GL_GOOGLE_include_directive : require
#include "lib/prelude.glsl"
#include "lib/exposure.glsl"

layout(local_size_x_id = SPEC_GROUP_SIZE) in;
layout(set = 0, binding = 0, scalar) readonly buffer Image { float image[]; };
layout(set = 0, binding = 1, scalar) readonly buffer Exposures { vec4 exposures[]; };
layout(set = 0, binding = 2, scalar) writeonly buffer Exposed { float exposed[]; };
layout(push_constant, scalar) uniform Push { ExposurePush push; };

void main() {
    const uint i = item_index();
    if (i >= push.size[0] * push.size[1]) return;
    const uint at = (i / push.size[0]) * push.stride + i % push.size[0], first = EXPOSURE_TEXELS * push.photo;
    const vec4 rows[3] = {exposures[first], exposures[first + 1u], exposures[first + 2u]};
    const vec3 color = exposed_color(rows, vec3(image[PLANE_R * push.plane_floats + at], image[PLANE_G * push.plane_floats + at],
                                                image[PLANE_B * push.plane_floats + at]));
    [[unroll]] for (uint c = 0; c < 3; ++c) exposed[c * push.plane_floats + at] = color[c];
}
