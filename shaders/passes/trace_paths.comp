#version 460
// SPDX-License-Identifier: Apache-2.0
// Path tracing: light that reaches a camera.
// One invocation owns one pixel. It reads the mesh, the lights and the view, and adds `samples` paths to the pixel's
// sum of radiance and coverage. When a path ends, the next one begins in the same iteration: lanes of a subgroup wait
// for each other at the end only.
// A path hits a surface, samples one light, and continues in a direction sampled from the reflection. Emission is found
// both ways, weighted by the balance heuristic (Veach and Guibas 1995).
#extension GL_GOOGLE_include_directive : require
#include "lib/prelude.glsl"
#include "lib/traversal.glsl"
#include "lib/low_discrepancy.glsl"
#include "lib/reflection.glsl"
#include "lib/lights.glsl"

layout(local_size_x_id = SPEC_GROUP_SIZE) in;
layout(set = 0, binding = 7, scalar) uniform ViewUniform { TraceView view; };
layout(set = 0, binding = 8, scalar) buffer Sums { vec4 sums[]; };
layout(set = 0, binding = 9, scalar) buffer Counted { TraceCounts counts; };
layout(set = 0, binding = 10, scalar) readonly buffer PixelRays { float pixel_rays[]; };
layout(push_constant, scalar) uniform Push { TracePush push; };
#include "lib/pixel_rays.glsl"

struct Path {
    vec3 origin, direction, throughput, radiance;
    float density;  // of the last direction; 0: a camera ray
    float coverage;
    float blur;     // width of the widest reflection so far. Sharper mirrors are widened to it, so that no single path
                    // finds the sun in one (Kaplanyan and Dachsbacher 2013, "Path Space Regularization").
    uint turn;
};

uvec4 words(uint pixel, uint purpose) { return pcg4d(uvec4(pixel, purpose, push.seed[0], push.seed[1])); }
vec2 pair(uint pixel, uint sample_index, uint purpose) { return sobol_pair(sample_index, words(pixel, purpose).xyz); }

vec3 sky(vec3 direction) {
    const vec3 end = direction.y >= 0.0 ? vec3(view.zenith[0], view.zenith[1], view.zenith[2])
                                        : vec3(view.ground[0], view.ground[1], view.ground[2]);
    return mix(vec3(view.horizon[0], view.horizon[1], view.horizon[2]), end, abs(direction.y));
}

Path start(uint pixel, uint sample_index) {
    const vec2 at = vec2(pixel % view.size[0], pixel / view.size[0]) + pair(pixel, sample_index, 0u);
    if (LENSES != 0u) {
        const PixelRay ray = pixel_ray(at);
        return Path(ray.origin, ray.direction, vec3(1.0), vec3(0.0), 0.0, 0.0, 0.0, 0u);
    }
    const vec3 d = vec3((at - vec2(view.center[0], view.center[1])) / vec2(view.focal[0], view.focal[1]), 1.0);
    const vec3 row0 = vec3(view.rotation[0], view.rotation[1], view.rotation[2]);
    const vec3 row1 = vec3(view.rotation[3], view.rotation[4], view.rotation[5]);
    const vec3 row2 = vec3(view.rotation[6], view.rotation[7], view.rotation[8]);
    return Path(vec3(view.position[0], view.position[1], view.position[2]), normalize(d.x * row0 + d.y * row1 + row2),
                vec3(1.0), vec3(0.0), 0.0, 0.0, 0.0, 0u);
}

Hit search(vec3 origin, vec3 direction, float reach, bool from_camera, bool any_will_do, uint chance) {
    const Hit hit = trace(Ray(origin, direction, reach, from_camera, any_will_do, -1.0, chance), push.max_steps);
    if (hit.unfinished) atomicAdd(counts.unfinished_rays, 1u);
    return hit;
}

// Contribution of one sampled light at the surface, with its balance-heuristic weight.
vec3 lit(Path path, uint pixel, uint sample_index, Reflector r, mat3 frame, vec3 point, vec3 side, uint chance) {
    const uint purpose = 4u * path.turn;
    const Incoming light = light_at(point, push.lights, pair(pixel, sample_index, purpose + 1u).y,
                                    pair(pixel, sample_index, purpose + 2u));
    float density;
    const vec3 reflected = evaluate_reflection(r, -path.direction * frame, light.direction * frame, density);
    vec3 arriving = path.throughput * reflected * light.radiance;
    if (dot(light.direction, side) <= 0.0) arriving = vec3(0.0);
    if (light.density > 0.0) arriving *= light.density / (light.density + density);
    const bool asks = brightest(arriving) > 0.0;
    // A ray of reach 0 ends at once.
    const Hit hit = search(leave_surface(point, side), light.direction, asks ? light.distance : 0.0, false, true, chance);
    return asks && hit.triangle == NO_TRIANGLE ? arriving : vec3(0.0);
}

// Extends the path by one surface. Returns whether the path continues.
bool meet(inout Path path, uint pixel, uint sample_index) {
    if (LENSES != 0u && path.direction == vec3(0.0)) return false;
    const uvec4 chance = words(pixel ^ 0x5bd1e995u, sample_index * 32u + path.turn);
    const Hit hit = search(path.origin, path.direction, 3e38, path.turn == 0u, false, chance.x);
    if (hit.triangle == NO_TRIANGLE) {
        if (path.turn > 0u) path.radiance += path.throughput * sky(path.direction);
        return false;
    }
    if (path.turn == 0u) path.coverage = 1.0;
    const int at = int(hit.triangle * TRIANGLE_TEXELS);
    const vec3 corner = uintBitsToFloat(fetch(triangles, at).xyz);
    const vec3 e1 = uintBitsToFloat(fetch(triangles, at + 1).xyz);
    const vec3 e2 = uintBitsToFloat(fetch(triangles, at + 2).xyz);
    const vec3 point = corner + hit.barycentric.x * e1 + hit.barycentric.y * e2;
    const vec3 outward = normalize(cross(e1, e2));
    const bool front = dot(outward, path.direction) < 0.0;
    const vec3 side = front ? outward : -outward;
    const Surface surface = surface_at(hit.triangle, hit.barycentric);
    const Material material = material_at(hit.material, surface);

    if (front || (material.flags & MATERIAL_TWO_SIDED) != 0u) {
        const float by_light =
            material.light_density * hit.distance * hit.distance / max(abs(dot(outward, path.direction)), 1e-6);
        const float weight = path.turn == 0u ? 1.0 : path.density / (path.density + by_light);
        path.radiance += path.throughput * material.emitted * weight;
    }
    vec3 normal = front ? surface.normal : -surface.normal;
    const float size2 = dot(normal, normal);
    // A shading normal that points away from the ray is replaced by the geometric one.
    normal = size2 > 1e-12 && dot(normal, path.direction) < 0.0 ? normal * inversesqrt(size2) : side;
    const mat3 frame = frame_of(normal);
    const vec3 out_dir = -path.direction * frame;
    const Reflector r = reflector_of(material, out_dir.z, path.blur);
    path.radiance += lit(path, pixel, sample_index, r, frame, point, side, chance.y);

    if (++path.turn > TRACE_BOUNCES) return false;
    const uint purpose = 4u * path.turn;
    const float choice = pair(pixel, sample_index, purpose - 3u).x;
    const vec3 in_dir = sample_reflection(r, out_dir, choice, pair(pixel, sample_index, purpose - 1u));
    path.blur = max(path.blur, choice < r.mirror_share ? r.width : LAMBERT_BLUR);
    float density;
    const vec3 reflected = evaluate_reflection(r, out_dir, in_dir, density);
    path.direction = frame * in_dir;
    if (!(density > 0.0) || !(dot(path.direction, side) > 0.0)) return false;
    path.throughput *= reflected / density;
    path.density = density;
    path.origin = leave_surface(point, side);
    if (path.turn > TRACE_ROULETTE) {
        const float survival = min(0.95, brightest(path.throughput));
        if (!(float(chance.z >> 8u) < survival * 16777216.0)) return false;
        path.throughput /= survival;
    }
    return true;
}

void main() {
    const uint pixel = item_index();
    if (pixel >= view.size[0] * view.size[1]) return;
    vec4 sum = sums[pixel];
    uint sample_index = push.first_sample;
    const uint end = sample_index + push.samples;
    Path path = start(pixel, sample_index);
    const uint most = push.samples * (TRACE_BOUNCES + 1u);
    for (uint turn = 0u; turn < most && sample_index < end; ++turn) {
        if (meet(path, pixel, sample_index)) continue;
        if (is_finite(path.radiance))
            sum += vec4(min(path.radiance, vec3(view.sample_max)), path.coverage);
        else
            atomicAdd(counts.dropped_samples, 1u);
        path = start(pixel, ++sample_index);
    }
    sums[pixel] = sum;
}
