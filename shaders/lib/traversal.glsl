// SPDX-License-Identifier: Apache-2.0
// The nearest triangle on a ray, or whether there is one. Nodes have two children; the nearer is
// visited first, the farther one is pushed on a stack that is deep enough for every hierarchy
// (mesh/hierarchy.h). CPU reference: check/reference/tracing.cpp.
#ifndef EWA_LIB_TRAVERSAL
#define EWA_LIB_TRAVERSAL
#include "lib/mesh.glsl"
#include "lib/random.glsl"

const uint NO_TRIANGLE = 0xffffffffu;

struct Ray {
    vec3 origin, direction;
    float reach;       // greatest distance, in lengths of the direction
    bool from_camera;  // passes through the back of one-sided surfaces
    bool any_will_do;
    float blend_threshold;  // < 0: blended surfaces stop the ray by chance; else if their opacity reaches this
    uint chance;            // seed of that chance
};

struct Hit {
    uint triangle;     // NO_TRIANGLE: none
    float distance;    // in lengths of the direction
    vec2 barycentric;  // weights of corners 1 and 2
    uint material;
    bool unfinished;   // the step limit ended the search
};

// Distance at which the ray enters a box, or 3.4e38 if it misses. The far side is moved out by two roundings (Ize 2013).
float enter_box(vec3 low, vec3 high, vec3 origin, vec3 inverse, float reach) {
    const vec3 a = (low - origin) * inverse, b = (high - origin) * inverse;
    const vec3 near = min(a, b), far = max(a, b);
    const float first = max(max(near.x, near.y), max(near.z, 0.0));
    const float last = min(min(far.x, far.y), far.z) * 1.00000024;
    return first <= min(last, reach) && low.x <= high.x ? first : 3.4e38;
}

bool stops(Ray ray, uint triangle, uint material, vec2 barycentric) {
    uint flags;
    float cutoff;
    const float opacity = opacity_at(triangle, material, barycentric, flags, cutoff);
    if ((flags & MATERIAL_MASKED) != 0u) return opacity >= cutoff;
    if ((flags & MATERIAL_BLENDED) == 0u) return true;
    if (ray.blend_threshold >= 0.0) return opacity >= ray.blend_threshold;
    return float(pcg4d(uvec4(ray.chance, triangle, 0u, 0u)).x >> 8u) < opacity * 16777216.0;
}

// Moeller and Trumbore 1997. Triangles are slightly enlarged, so that neighbours leave no gap.
void meet_triangle(Ray ray, uint triangle, inout Hit hit) {
    const int at = int(triangle * TRIANGLE_TEXELS);
    const uvec4 corner = fetch(triangles, at);
    const vec3 e1 = uintBitsToFloat(fetch(triangles, at + 1).xyz);
    const uvec4 last = fetch(triangles, at + 2);
    const vec3 e2 = uintBitsToFloat(last.xyz);
    const vec3 p = cross(ray.direction, e2), s = ray.origin - uintBitsToFloat(corner.xyz), q = cross(s, e1);
    const float determinant = dot(e1, p), inverse = 1.0 / determinant;
    const vec2 b = vec2(dot(s, p), dot(ray.direction, q)) * inverse;
    const float t = dot(e2, q) * inverse;
    bool met = determinant != 0.0 && b.x >= -1e-6 && b.y >= -1e-6 && b.x + b.y <= 1.000001 && t > 0.0 && t < hit.distance;
    if (ray.from_camera && determinant < 0.0 && last.w == 0u) met = false;
    if (ALPHA_TESTED != 0u && met) met = stops(ray, triangle, corner.w, b);
    if (met) {
        hit.triangle = triangle;
        hit.distance = t;
        hit.barycentric = b;
        hit.material = corner.w;
    }
}

Hit trace(Ray ray, uint max_steps) {
    Hit hit = Hit(NO_TRIANGLE, ray.reach, vec2(0.0), 0u, false);
    vec3 inverse;
    // No component is zero: no product below is 0 times infinity.
    [[unroll]] for (int i = 0; i < 3; ++i) {
        const float d = ray.direction[i];
        inverse[i] = 1.0 / (abs(d) < 1e-18 ? (d < 0.0 ? -1e-18 : 1e-18) : d);
    }
    uint waiting[TRACE_STACK];
    uint top = 0u, current = 0u, step = 0u;
    bool searching = true;
    for (; searching && step < max_steps; ++step) {
        bool pop = false;
        if ((current & LEAF_FLAG) == 0u) {
            const int at = int(current * NODE_TEXELS);
            const uvec4 low0 = fetch(nodes, at), low1 = fetch(nodes, at + 2);
            const vec3 high0 = uintBitsToFloat(fetch(nodes, at + 1).xyz);
            const vec3 high1 = uintBitsToFloat(fetch(nodes, at + 3).xyz);
            const float t0 = enter_box(uintBitsToFloat(low0.xyz), high0, ray.origin, inverse, hit.distance);
            const float t1 = enter_box(uintBitsToFloat(low1.xyz), high1, ray.origin, inverse, hit.distance);
            const bool first = t0 <= t1;
            current = first ? low0.w : low1.w;
            if (max(t0, t1) < 3.3e38 && top < TRACE_STACK) waiting[top++] = first ? low1.w : low0.w;
            pop = min(t0, t1) >= 3.3e38;
        }
        if (!pop && (current & LEAF_FLAG) != 0u) {
            meet_triangle(ray, current & LEAF_FIRST_MASK, hit);
            pop = (current >> LEAF_COUNT_SHIFT) == (LEAF_FLAG >> LEAF_COUNT_SHIFT);
            if (!pop) current += 1u - (1u << LEAF_COUNT_SHIFT);
            if (ray.any_will_do && hit.triangle != NO_TRIANGLE) searching = false;
        }
        if (pop) {
            if (top == 0u) searching = false;
            else current = waiting[--top];
        }
    }
    hit.unfinished = searching;
    return hit;
}

// Offsets a point from the surface to the side of the normal, by as many roundings as its coordinates need (Waechter and
// Binder 2019, "A Fast and Robust Method for Avoiding Self-Intersection").
vec3 leave_surface(vec3 point, vec3 normal) {
    const ivec3 steps = ivec3(256.0 * normal);
    const ivec3 signed_steps = mix(steps, -steps, lessThan(point, vec3(0.0)));
    const vec3 moved = intBitsToFloat(floatBitsToInt(point) + signed_steps);
    return mix(moved, point + normal / 65536.0, lessThan(abs(point), vec3(1.0 / 32.0)));
}
#endif
