#version 460
// SPDX-License-Identifier: Apache-2.0
// Gradient of grid_slice by the render. One invocation owns one pixel. It reads the render and 8 cells of the grid, and
// updates dL/d(image) in place.
#extension GL_GOOGLE_include_directive : require
#include "lib/prelude.glsl"
#include "lib/image.glsl"

layout(local_size_x_id = SPEC_GROUP_SIZE) in;
layout(set = 0, binding = 0, scalar) readonly buffer Image { float image[]; };
layout(set = 0, binding = 1, scalar) readonly buffer Grids { vec4 grids[]; };
layout(set = 0, binding = 2, scalar) buffer ImageGradient { float image_gradient[]; };
layout(push_constant, scalar) uniform Push { GridPush push; };
#include "lib/grid_slice.glsl"

void main() {
    const uint i = item_index();
    if (i >= push.image.size[0] * push.image.size[1]) return;
    const uint at = pixel_offset(push.image, i);
    const uvec3 planes = uvec3(PLANE_R, PLANE_G, PLANE_B) * push.image.plane_floats + at;
    const vec3 color = vec3(image[planes.r], image[planes.g], image[planes.b]);
    const vec3 gradient = vec3(image_gradient[planes.r], image_gradient[planes.g], image_gradient[planes.b]);
    const GridSlice slice = slice_at(i, color);
    const float grey = dot(GREY, color);
    vec3 back = vec3(0.0);
    float by_level = 0.0;
    [[unroll]] for (uint c = 0; c < 3; ++c) {
        back += gradient[c] * slice.rows[c].xyz;
        by_level += gradient[c] * dot(slice.by_level[c], vec4(color, 1.0));
    }
    if (!ONE_CELL && grey >= 0.0 && grey <= 1.0) back += by_level * float(GRID_DEPTH - 1u) * GREY;
    [[unroll]] for (uint c = 0; c < 3; ++c) image_gradient[planes[c]] = back[c];
}
