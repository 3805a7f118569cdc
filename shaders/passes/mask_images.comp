#version 460
// SPDX-License-Identifier: Apache-2.0
// Prepares the loss of a masked training image, whose alpha is each pixel's weight.
// One invocation owns one pixel. It reads the training image and the render. It writes the training image, unchanged,
// into the target planes, and a copy of the render that is moved towards the target where the weight is below 1.
#extension GL_GOOGLE_include_directive : require
#include "lib/prelude.glsl"
#include "lib/image.glsl"

layout(local_size_x_id = SPEC_GROUP_SIZE) in;
COLOR_TEXELS(0, photo);
layout(set = 0, binding = 1, scalar) readonly buffer Image { float image[]; };
layout(set = 0, binding = 2, scalar) writeonly buffer Target { float target[]; };
layout(set = 0, binding = 3, scalar) writeonly buffer Masked { float masked[]; };
layout(push_constant, scalar) uniform Push { MaskPush push; };

void main() {
    const uint i = item_index();
    if (i >= push.image.size[0] * push.image.size[1]) return;
    const vec4 texel = fetch_color(photo, push.first_pixel + i);
    const uint at = pixel_offset(push.image, i);
    for (uint c = 0; c < 3; ++c) {
        const uint k = c * push.image.plane_floats + at;
        target[k] = texel[c];
        // Exact where the weight is 1 and where the images are equal.
        masked[k] = texel.a == 1.0 ? image[k] : texel[c] + texel.a * (image[k] - texel[c]);
    }
}
