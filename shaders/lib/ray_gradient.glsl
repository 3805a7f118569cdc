// SPDX-License-Identifier: Apache-2.0
// Adds the gradient of a strip's rays to the slot of an instance. rays.glsl describes W and V; here they are in the frame in
// which b at the mean is (0, 0, |b|). The same lane always adds to the same slot, so that sums have one order.
// Needs rays.glsl. The including pass declares slots.
#ifndef EWA_LIB_RAY_GRADIENT
#define EWA_LIB_RAY_GRADIENT

vec4 subgroup_sum(vec4 v) { return vec4(subgroup_sum(v.x), subgroup_sum(v.y), subgroup_sum(v.z), subgroup_sum(v.w)); }

// The sums of a slot, in its order.
struct RayTerms {
    vec4 first, second, third;
    float blue;
};

RayTerms no_ray_terms() { return RayTerms(vec4(0.0), vec4(0.0), vec4(0.0), 0.0); }

// g, s1, s2: G, S1 and S2 of this lane's ray. counts: whether it has any.
void add_ray_terms(inout RayTerms sum, RaySplat r, Meeting m, bool counts, float g, float s1, float s2, vec3 color) {
    const vec3 x = counts ? (1.4142135623730951 / m.s) * vec3(m.h * m.u, m.h * m.v, -r.bend.z * m.q) : vec3(0.0);
    const vec3 b = counts ? vec3(r.bend.z * m.u, r.bend.z * m.v, m.h) / m.root : vec3(0.0);
    g = counts ? g : 0.0;
    const float along = counts ? (KERNEL == KERNEL_DENSITY ? s2 - g : s2) : 0.0;
    s1 = counts ? s1 : 0.0;
    color = counts ? color : vec3(0.0);
    const vec3 diagonal = -g * x * x + 2.0 * s1 * b * x + along * b * b;
    const vec3 beside = -g * x.yxx * x.zzy + s1 * (b.yxx * x.zzy + x.yxx * b.zzy) + along * b.yxx * b.zzy;  // 23, 13, 12
    const vec3 v = -g * x + s1 * b;
    sum.first += vec4(diagonal, beside.z);
    sum.second += vec4(beside.y, beside.x, v.xy);
    sum.third += vec4(v.z, g, color.rg);
    sum.blue += color.b;
}

// Over the lanes.
RayTerms summed(RayTerms own) {
    return RayTerms(subgroup_sum(own.first), subgroup_sum(own.second), subgroup_sum(own.third), subgroup_sum(own.blue));
}

void add_terms_to_slot(uint instance, RayTerms all) {
    const uint at = RAY_SLOT_TEXELS * instance;
    slots[at] += all.first;
    slots[at + 1u] += all.second;
    slots[at + 2u] += all.third;
    slots[at + 3u].x += all.blue;
}

// Adds what all lanes have for one splat.
void add_to_slot(RaySplat r, Meeting m, bool counts, float g, float s1, float s2, vec3 color) {
    RayTerms own = no_ray_terms();
    add_ray_terms(own, r, m, counts, g, s1, s2, color);
    const RayTerms all = summed(own);
    // Without loops: their turns would count (rays.glsl).
    if (LANE == r.at % SUBGROUP) add_terms_to_slot(r.at, all);
}

vec3 gradient_of(uint at) {
    const uint plane = push.image.plane_floats;
    return vec3(image_gradient[PLANE_R * plane + at], image_gradient[PLANE_G * plane + at], image_gradient[PLANE_B * plane + at]);
}

vec3 color_of(uint at) {
    const uint plane = push.image.plane_floats;
    return vec3(planes[PLANE_R * plane + at], planes[PLANE_G * plane + at], planes[PLANE_B * plane + at]);
}
#endif
