#version 460
// SPDX-License-Identifier: Apache-2.0
// What the loss compares where a photograph's alpha says how much a pixel counts: spreads the photograph into planes, as it
// is, and pulls the rendering onto it where it counts less. One invocation owns one pixel.
#extension GL_GOOGLE_include_directive : require
#include "lib/prelude.glsl"

layout(local_size_x_id = SPEC_GROUP_SIZE) in;
layout(set = 0, binding = 0) uniform samplerBuffer photo;
layout(set = 0, binding = 1, scalar) readonly buffer Image { float image[]; };
layout(set = 0, binding = 2, scalar) writeonly buffer Target { float target[]; };
layout(set = 0, binding = 3, scalar) writeonly buffer Masked { float masked[]; };
layout(push_constant, scalar) uniform Push { MaskPush push; };

void main() {
    const uint i = item_index();
    if (i >= push.size[0] * push.size[1]) return;
    const vec4 texel = texelFetch(photo, int(i));
    const uint at = (i / push.size[0]) * push.stride + i % push.size[0];
    for (uint c = 0; c < 3; ++c) {
        const uint k = c * push.plane_floats + at;
        target[k] = texel[c];
        // Exact both where the pixel counts wholly and where the pictures are equal.
        masked[k] = texel.a == 1.0 ? image[k] : texel[c] + texel.a * (image[k] - texel[c]);
    }
}
