#version 460
// SPDX-License-Identifier: Apache-2.0
// Finds what the centre of each pixel sees.
// One invocation owns one pixel. It reads the mesh and the view. It writes the camera's z, the triangle and the weights
// of its corners 1 and 2, floats by their bits. Without a triangle, z is 0. Through a lens, z is the distance along the ray.
#extension GL_GOOGLE_include_directive : require
#include "lib/prelude.glsl"
#include "lib/traversal.glsl"

layout(local_size_x_id = SPEC_GROUP_SIZE) in;
layout(set = 0, binding = 6, scalar) uniform ViewUniform { TraceView view; };
layout(set = 0, binding = 7, scalar) writeonly buffer Seen { uvec4 seen[]; };
layout(set = 0, binding = 8, scalar) buffer Counted { TraceCounts counts; };
layout(set = 0, binding = 9, scalar) readonly buffer PixelRays { float pixel_rays[]; };
layout(push_constant, scalar) uniform Push { TracePush push; };
#include "lib/pixel_rays.glsl"

void main() {
    const uint pixel = item_index();
    if (pixel >= view.size[0] * view.size[1]) return;
    const vec2 at = vec2(pixel % view.size[0], pixel / view.size[0]) + 0.5;
    const vec2 d = (at - vec2(view.center[0], view.center[1])) / vec2(view.focal[0], view.focal[1]);
    const vec3 row0 = vec3(view.rotation[0], view.rotation[1], view.rotation[2]);
    const vec3 row1 = vec3(view.rotation[3], view.rotation[4], view.rotation[5]);
    const vec3 row2 = vec3(view.rotation[6], view.rotation[7], view.rotation[8]);
    // The direction has z = 1, so distances along it are depths.
    const Ray ray = Ray(vec3(view.position[0], view.position[1], view.position[2]), d.x * row0 + d.y * row1 + row2, 3e38,
                        true, false, DEPTH_ALPHA, 0u);
    const PixelRay own = pixel_ray(at);
    const bool sees = LENSES == 0u || own.direction != vec3(0.0);
    const Hit hit = trace(LENSES == 0u ? ray : Ray(own.origin, own.direction, sees ? 3e38 : 0.0, true, false, DEPTH_ALPHA, 0u),
                          push.max_steps);
    if (hit.unfinished) atomicAdd(counts.unfinished_rays, 1u);
    const bool met = sees && hit.triangle != NO_TRIANGLE;
    seen[pixel] = met ? uvec4(floatBitsToUint(hit.distance), hit.triangle, floatBitsToUint(hit.barycentric))
                      : uvec4(0u, NO_TRIANGLE, 0u, 0u);
}
