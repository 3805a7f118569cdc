#version 460
// SPDX-License-Identifier: Apache-2.0
// Adds the sky behind the splats to an image that was blended over black: C + T sky.
// One invocation owns one pixel. It reads the camera and the sky, and updates the pixel's colour in place.
#extension GL_GOOGLE_include_directive : require
#include "lib/prelude.glsl"
#include "lib/image.glsl"
#define BINDING_CAMERA 1
#include "lib/sky.glsl"

layout(local_size_x_id = SPEC_GROUP_SIZE) in;
layout(set = 0, binding = 0, scalar) buffer Planes { float planes[]; };
layout(set = 0, binding = 2, scalar) readonly buffer Texels { vec3 texels[]; };
layout(push_constant, scalar) uniform Push { SkyPush push; };

void main() {
    const uint i = item_index();
    if (i >= push.image.size[0] * push.image.size[1]) return;
    const SkyCorners corners = sky_corners(push, uvec2(i % push.image.size[0], i / push.image.size[0]));
    vec3 sky = vec3(0.0);
    [[unroll]] for (uint k = 0u; k < 4u; ++k) sky += corners.weights[k] * texels[corners.texels[k]];
    const uint at = pixel_offset(push.image, i);
    const float left = planes[PLANE_T * push.image.plane_floats + at];
    [[unroll]] for (uint c = 0u; c < 3u; ++c) planes[c * push.image.plane_floats + at] += left * sky[c];
}
