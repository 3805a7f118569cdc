// SPDX-License-Identifier: Apache-2.0
// Next-event sampling: punctual lights (KHR_lights_punctual) and emissive triangles. One light is drawn by its
// share of the power (alias method, Vose 1991). The sky is not sampled: it is smooth, so sampling the surface's
// reflection finds it well.
#ifndef EWA_LIB_LIGHTS
#define EWA_LIB_LIGHTS
WORD_TEXELS(6, lights);

struct Incoming {
    vec3 direction;    // to the light
    float distance;
    vec3 radiance;     // triangle: divided by the density; else normal irradiance, divided by the probability
    float density;     // per steradian; 0: the light has no extent
};

Incoming light_at(vec3 point, uint count, float choice, vec2 u) {
    Incoming none = Incoming(vec3(0.0, 1.0, 0.0), 0.0, vec3(0.0), 0.0);
    if (count == 0u) return none;
    const float place = choice * float(count);
    uint index = min(uint(place), count - 1u);
    const uvec4 alias = fetch(lights, int(index * LIGHT_TEXELS) + 3);
    if (place - float(index) >= uintBitsToFloat(alias.z)) index = alias.w;
    const int at = int(index * LIGHT_TEXELS);
    const uvec4 a = fetch(lights, at), c = fetch(lights, at + 2), d = fetch(lights, at + 3);
    const vec4 b = uintBitsToFloat(fetch(lights, at + 1));
    const vec3 position = uintBitsToFloat(a.xyz);
    if (a.w == LIGHT_DIRECTIONAL) return Incoming(position, 3e38, b.rgb / b.a, 0.0);
    if (a.w != LIGHT_TRIANGLE) {
        const vec3 to = position - point;
        const float distance = length(to), range = uintBitsToFloat(c.w);
        if (!(distance > 0.0)) return none;
        const vec3 direction = to / distance;
        // The specification's window functions of range and cone.
        const float ratio = range > 0.0 ? distance / range : 0.0, ratio2 = ratio * ratio;
        float window = clamp(1.0 - ratio2 * ratio2, 0.0, 1.0);
        if (a.w == LIGHT_SPOT) {
            const float cone = clamp(dot(-direction, uintBitsToFloat(c.xyz)) * uintBitsToFloat(d.x) + uintBitsToFloat(d.y),
                                     0.0, 1.0);
            window *= cone * cone;
        }
        return Incoming(direction, distance, b.rgb * (window / (distance * distance * b.a)), 0.0);
    }
    const int triangle = int(c.w * TRIANGLE_TEXELS);
    const uvec4 corner = fetch(triangles, triangle);
    const vec3 e1 = uintBitsToFloat(fetch(triangles, triangle + 1).xyz);
    const vec3 e2 = uintBitsToFloat(fetch(triangles, triangle + 2).xyz);
    const float root = sqrt(u.x);
    const vec2 w = vec2(root * (1.0 - u.y), root * u.y);
    const vec3 to = uintBitsToFloat(corner.xyz) + w.x * e1 + w.y * e2 - point;
    const float distance2 = dot(to, to), distance = sqrt(distance2);
    if (!(distance > 0.0)) return none;
    const vec3 direction = to / distance;
    const Material m = material_at(corner.w, surface_at(c.w, w));
    float facing = -dot(normalize(cross(e1, e2)), direction);
    if ((m.flags & MATERIAL_TWO_SIDED) != 0u) facing = abs(facing);
    if (!(facing > 1e-6)) return none;
    const float density = m.light_density * distance2 / facing;
    return Incoming(direction, distance * 0.9999, m.emitted / density, density);
}
#endif
