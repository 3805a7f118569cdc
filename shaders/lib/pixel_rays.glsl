// SPDX-License-Identifier: Apache-2.0
// The rays of a view through a lens, from a table of those of the pixels' corners. The including pass declares view and pixel_rays
// before this file.
#ifndef EWA_LIB_PIXEL_RAYS
#define EWA_LIB_PIXEL_RAYS
layout(constant_id = SPEC_LENSES) const uint LENSES = 0u;

struct PixelRay {
    vec3 origin, direction;  // direction: of unit length, or zero where the lens shows nothing
};

// at: px. Between the corners of its pixel, the ray is interpolated.
PixelRay pixel_ray(vec2 at) {
    PixelRay ray = PixelRay(vec3(0.0), vec3(0.0));
    if (LENSES == 0u) return ray;
    const uvec2 first = min(uvec2(at), uvec2(view.size[0], view.size[1]) - 1u);
    const vec2 share = at - vec2(first);
    bool all = true;
    [[unroll]] for (uint corner = 0u; corner < 4u; ++corner) {
        const uvec2 step = uvec2(corner & 1u, corner >> 1u);
        const uint i = PIXEL_RAY_FLOATS * ((first.y + step.y) * (view.size[0] + 1u) + first.x + step.x);
        const float weight = (step.x == 1u ? share.x : 1.0 - share.x) * (step.y == 1u ? share.y : 1.0 - share.y);
        const vec3 direction = vec3(pixel_rays[i + 3u], pixel_rays[i + 4u], pixel_rays[i + 5u]);
        all = all && direction != vec3(0.0);
        ray.origin += weight * vec3(pixel_rays[i], pixel_rays[i + 1u], pixel_rays[i + 2u]);
        ray.direction += weight * direction;
    }
    ray.direction = all ? normalize(ray.direction) : vec3(0.0);
    return ray;
}
#endif
