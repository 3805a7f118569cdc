#version 460
// SPDX-License-Identifier: Apache-2.0
// Gradient of project_rays.
// One invocation owns splat i. It reads the splat's slots in the order of its tiles and its parameters, adds the slots, and
// writes dL/d(parameters) in the parameters' layout. An infinity becomes the largest float32. NaN becomes zero and is counted.
#extension GL_GOOGLE_include_directive : require
#define BINDING_CAMERA 1
#include "lib/prelude.glsl"
#include "lib/params.glsl"
#include "lib/stored_splat.glsl"
#include "lib/ray_shape.glsl"
#include "lib/sh.glsl"

layout(local_size_x_id = SPEC_GROUP_SIZE) in;
layout(constant_id = SPEC_SH_DEGREE) const uint SH_DEGREE = 3;

TEXELS(0, params);
TEXELS(2, records);
TEXELS(3, slots);
layout(set = 0, binding = 4, scalar) readonly buffer TileCounts { uint tile_counts[]; };
layout(set = 0, binding = 5, scalar) readonly buffer FirstInstances { uint first_instances[]; };
layout(set = 0, binding = 6, scalar) buffer CountsBlock { Counts counts; };
layout(set = 0, binding = 7, scalar) readonly buffer SortedIndices { uint sorted_indices[]; };
STORED_WORD_TEXELS(8, gradients);
layout(push_constant, scalar) uniform Push { UpdatePush push; };

const uint SH_FLOATS = 3 * (SH_DEGREE + 1) * (SH_DEGREE + 1);
const uint PLANES = (PARAM_SH + SH_FLOATS + 3) / 4;

uint index_of(uint plane, uint i) { return param_texel(push.planes, plane, i); }

void store(uint plane, uint i, vec4 gradient) {
    const bvec4 number = equal(gradient, gradient);
    gradients[index_of(plane, i)] = as_texel(floatBitsToUint(mix(vec4(0.0), clamp(gradient, -3.402823466e38, 3.402823466e38), number)));
    if (!all(number)) atomicAdd(counts.dropped_updates, 1u);
}

// Stores the gradient of all spherical harmonics but the one in plane 2, and returns that. direction_gradient: dL/d(unit
// direction).
float store_sh(uint i, vec3 color_gradient, vec3 direction, out vec3 direction_gradient) {
    float basis[16];
    vec3 slope[16];
    sh_basis(SH_DEGREE, direction, basis);
    sh_basis_gradient(SH_DEGREE, direction, slope);
    direction_gradient = vec3(0.0);
    [[unroll]] for (uint plane = PARAM_SH / 4 + 1; plane < PLANES; ++plane) {
        const vec4 value = fetch(params, index_of(plane, i));
        vec4 gradient = vec4(0.0);
        [[unroll]] for (uint c = 0; c < 4; ++c) {
            const uint s = 4 * plane + c - PARAM_SH;
            if (s < SH_FLOATS) {
                gradient[c] = basis[s / 3] * color_gradient[s % 3];
                direction_gradient += (value[c] * color_gradient[s % 3]) * slope[s / 3];
            }
        }
        store(plane, i, gradient);
    }
    return basis[0] * color_gradient.r;
}

// Each iteration adds 8 slots: some drivers stop a loop after 65,535 iterations.
void sum_ray_slots(uint first, uint count, out vec4 sum[RAY_SLOT_TEXELS]) {
    [[unroll]] for (uint t = 0; t < RAY_SLOT_TEXELS; ++t) sum[t] = vec4(0.0);
    for (uint j = 0u; j < count; j += 8u) {
        [[unroll]] for (uint c = 0; c < 8; ++c) {
            const bool there = j + c < count;
            const uint slot = RAY_SLOT_TEXELS * sorted_indices[there ? first + j + c : first];
            [[unroll]] for (uint t = 0; t < RAY_SLOT_TEXELS; ++t) {
                const vec4 texel = fetch(slots, slot + t);
                if (there) sum[t] += texel;
            }
        }
    }
}

void main() {
    const uint i = item_index();
    if (i >= push.splats || counts.instances > push.instance_capacity) return;
    const uint count = tile_counts[i];
    const bool visible = count > 0u;
    const vec4 p0 = fetch(params, index_of(0, i)), p1 = fetch(params, index_of(1, i)), p2 = fetch(params, index_of(2, i));
    vec4 sum[RAY_SLOT_TEXELS];
    sum_ray_slots(visible ? first_instances[i] : 0u, count, sum);
    const View view = view_point(p0.xyz);
    float norm;
    const vec4 quaternion = normalize_quaternion(p1, norm);
    const RayShape r = ray_shape(view, camera_lens(), quaternion, p2.xyz, p0.w);

    // The mean of an invisible splat may be anything. Zero times a direction that is not finite is not zero.
    const vec3 direction = visible ? normalize(view.offset) : vec3(0.0);
    // max(0, .) passes no gradient where the colour is zero.
    const vec3 shown = fetch(records, RECORD_TEXELS * i + 2u).rgb;
    const vec3 color_sum = vec3(sum[2].zw, sum[3].x);
    const vec3 color_gradient = visible ? color_sum * vec3(greaterThan(shown, vec3(0.0))) : vec3(0.0);
    vec3 direction_gradient;
    const float red_gradient = store_sh(i, color_gradient, direction, direction_gradient);

    // W and V from the rays' frame to the splat's axes.
    const mat3 w = mat3(sum[0].x, sum[0].w, sum[1].x, sum[0].w, sum[0].y, sum[1].y, sum[1].x, sum[1].y, sum[0].z);
    const mat3 to_frame = transpose(r.frame);  // column k: axis k in the rays' frame
    vec3 by_log_scale = vec3(0.0), beside;
    [[unroll]] for (int k = 0; k < 3; ++k) {
        by_log_scale[k] = -dot(to_frame[k], w * to_frame[k]);
        beside[k] = -dot(to_frame[(k + 1) % 3], w * to_frame[(k + 2) % 3]);
    }
    const vec3 v = r.frame * vec3(sum[1].zw, sum[2].x);
    const float by_depth = sum[2].y;
    if (KERNEL == KERNEL_DENSITY) {
        // ln A - ln(s1 s2 s3): the derivative by ln s_k is minus the share of the product without s_k in A^2.
        const vec3 areas = r.sharpness * r.sharpness;
        by_log_scale -= by_depth * areas / (areas.x + areas.y + areas.z);
    }
    const vec3 torque = beside * scale_ratios(p2.xyz);
    const vec3 direction_part = (direction_gradient - direction * dot(direction, direction_gradient)) / length(view.offset);
    const vec3 mean_gradient =
        transpose(camera_rotation()) * (r.directions * (-v * r.sharpness / r.least_scale)) + direction_part;
    const bool clamped = KERNEL != KERNEL_DENSITY && sigmoid(p0.w) > float(ALPHA_MAX);
    const float logit_gradient = clamped ? 0.0 : by_depth * log_softplus_slope(p0.w);

    const vec4 zero = vec4(0.0);
    store(2, i, visible ? vec4(by_log_scale, red_gradient) : zero);
    store(1, i, visible ? torque_on_quaternion(quaternion, torque) / norm : zero);
    store(0, i, visible ? vec4(mean_gradient, logit_gradient) : zero);
}
