// SPDX-License-Identifier: Apache-2.0
// The sky, light from infinitely far by the direction of a ray: a map of size x size texels over an octahedron (Engelhardt
// and Dachsbacher 2008). The square is |x| + |y| + |z| = 1 seen along z. The half with z < 0 is folded outwards, so that
// each border continues in itself, mirrored at its middle. Colours are interpolated between four texels.
#ifndef EWA_LIB_SKY
#define EWA_LIB_SKY

// In texels, from the centre of texel (0, 0).
vec2 sky_place(vec3 direction, uint size) {
    const vec3 on = direction / (abs(direction.x) + abs(direction.y) + abs(direction.z));
    const vec2 folded = (1.0 - abs(on.yx)) * vec2(on.x < 0.0 ? -1.0 : 1.0, on.y < 0.0 ? -1.0 : 1.0);
    return (0.5 + 0.5 * (on.z < 0.0 ? folded : on.xy)) * float(size) - 0.5;
}

// The number of the texel that a position up to one beyond the border stands for.
uint sky_texel(ivec2 at, uint size) {
    const int last = int(size) - 1;
    if (at.x < 0 || at.x > last) at = ivec2(clamp(at.x, 0, last), last - at.y);
    if (at.y < 0 || at.y > last) at = ivec2(last - at.x, clamp(at.y, 0, last));
    return uint(at.y) * size + uint(at.x);
}

#ifdef BINDING_CAMERA
#include "lib/camera.glsl"
#include "lib/lens_ray.glsl"

// World axes, of any length; zero where the lens shows nothing. pixel: of the view, px.
vec3 sky_direction(vec2 pixel) {
    const vec2 at = (pixel - vec2(camera.center_hi[0], camera.center_hi[1])) /
                    vec2(camera.focal_hi[0], camera.focal_hi[1]);
    return (LENSES != 0u ? lens_ray(at) : vec3(at, 1.0)) * camera_rotation();
}

// The four texels that a pixel shows, and their weights: zero where the lens shows nothing. Pixels of one cell show the same texels.
struct SkyCorners {
    uint cell;
    uint texels[4];
    float weights[4];
};

SkyCorners sky_corners(SkyPush sky, uvec2 pixel) {
    const vec3 direction = sky_direction(vec2(pixel.x, pixel.y + sky.first_row) + 0.5);
    const bool shown = LENSES == 0u || direction != vec3(0.0);
    const vec2 place = shown ? sky_place(direction, sky.size) : vec2(0.0);
    const ivec2 corner = ivec2(floor(place));
    const vec2 part = place - vec2(corner);
    SkyCorners corners;
    corners.cell = uint(corner.y + 1) * (sky.size + 1u) + uint(corner.x + 1);
    [[unroll]] for (uint k = 0u; k < 4u; ++k) {
        const uvec2 far = uvec2(k & 1u, k >> 1u);
        corners.texels[k] = sky_texel(corner + ivec2(far), sky.size);
        corners.weights[k] = (far.x == 1u ? part.x : 1.0 - part.x) * (far.y == 1u ? part.y : 1.0 - part.y);
        if (!shown) corners.weights[k] = 0.0;
    }
    return corners;
}
#endif
#endif
