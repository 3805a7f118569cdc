#version 460
// SPDX-License-Identifier: Apache-2.0
// Applies a training image's bilateral grid to the render, before the loss compares the two.
// One invocation owns one pixel. It reads the render's planes and 8 cells of the grid, and writes the planes as the photo
// shows them.
#extension GL_GOOGLE_include_directive : require
#include "lib/prelude.glsl"
#include "lib/image.glsl"

layout(local_size_x_id = SPEC_GROUP_SIZE) in;
layout(set = 0, binding = 0, scalar) readonly buffer Image { float image[]; };
layout(set = 0, binding = 1, scalar) readonly buffer Grids { vec4 grids[]; };
layout(set = 0, binding = 2, scalar) writeonly buffer Exposed { float exposed[]; };
layout(push_constant, scalar) uniform Push { GridPush push; };
#include "lib/grid_slice.glsl"

void main() {
    const uint i = item_index();
    if (i >= push.image.size[0] * push.image.size[1]) return;
    const uint at = pixel_offset(push.image, i);
    const uvec3 planes = uvec3(PLANE_R, PLANE_G, PLANE_B) * push.image.plane_floats + at;
    const vec3 color = vec3(image[planes.r], image[planes.g], image[planes.b]);
    const vec3 shown = mapped(slice_at(i, color).rows, color);
    [[unroll]] for (uint c = 0; c < 3; ++c) exposed[planes[c]] = shown[c];
}
