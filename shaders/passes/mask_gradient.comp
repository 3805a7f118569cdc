#version 460
// SPDX-License-Identifier: Apache-2.0
// Gradient of mask_images: dL/d(image) times the pixel's weight.
// One invocation owns one pixel. It reads the weight from the training image's alpha, and updates dL/d(image) in place.
#extension GL_GOOGLE_include_directive : require
#include "lib/prelude.glsl"
#include "lib/image.glsl"

layout(local_size_x_id = SPEC_GROUP_SIZE) in;
COLOR_TEXELS(0, photo);
layout(set = 0, binding = 1, scalar) buffer ImageGradient { float image_gradient[]; };
layout(push_constant, scalar) uniform Push { MaskPush push; };

void main() {
    const uint i = item_index();
    if (i >= push.image.size[0] * push.image.size[1]) return;
    const float weight = fetch_color(photo, push.first_pixel + i).a;
    const uint at = pixel_offset(push.image, i);
    for (uint c = 0; c < 3; ++c) image_gradient[c * push.image.plane_floats + at] *= weight;
}
