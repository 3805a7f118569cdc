#version 460
// SPDX-License-Identifier: Apache-2.0
// Gradient of project_rays, fused with Adam as in update.comp, whose buffers and rules it shares.
// One invocation owns splat i. It reads the splat's slots in the order of its tiles and its parameters, adds the slots, carries the
// sums back to the parameters, and writes parameters and moments. The strategy reads the gradient by the mean across the ray, as
// one by the pixel (the rule of 3DGRUT, with the focal length in place of the image's half size). SPEC_MODE: UPDATE_* bits.
#extension GL_GOOGLE_include_directive : require
#define BINDING_CAMERA 1
#include "lib/prelude.glsl"
#include "lib/params.glsl"
#include "lib/stored_splat.glsl"
#include "lib/footprint_gradient.glsl"
#include "lib/splat_gradient.glsl"
#include "lib/ray_shape.glsl"

layout(local_size_x_id = SPEC_GROUP_SIZE) in;
layout(constant_id = SPEC_SH_DEGREE) const uint SH_DEGREE = 3;
layout(constant_id = SPEC_MODE) const uint MODE = 0;
const bool GRADIENT_ONLY = (MODE & UPDATE_GRADIENT_ONLY) != 0u;

TEXELS(0, params);
TEXELS(2, records);
TEXELS(3, slots);
WORD_TEXELS(4, moments1);
WORD_TEXELS(5, moments2);
layout(set = 0, binding = 6, scalar) readonly buffer TileCounts { uint tile_counts[]; };
layout(set = 0, binding = 7, scalar) readonly buffer FirstInstances { uint first_instances[]; };
layout(set = 0, binding = 8, scalar) buffer CountsBlock { Counts counts; };
STORED_TEXELS(9, params_out);
STORED_WORD_TEXELS(10, moments1_out);
STORED_WORD_TEXELS(11, moments2_out);
layout(set = 0, binding = 12, scalar) buffer Statistics { vec2 statistics[]; };
layout(set = 0, binding = 13, scalar) readonly buffer SortedIndices { uint sorted_indices[]; };
layout(set = 0, binding = 14, scalar) uniform Values { UpdateBlock push; };
#include "lib/splat_update.glsl"

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

// From the gradient of the wider splat to that of the splat: check/reference/rays.h has the formulas. by_opacity: dL/d(ln(c opacity)).
// by_mean: in the axes of r.eye.
void narrow(RayShape r, Widening w, float by_opacity, inout vec3 by_log_scale, inout vec3 torque, inout vec3 by_mean) {
    // What the formulas subtract nearly cancels for a splat that is far wider than a pixel. Then they are written by the share of the
    // pixel in each width, and by the mean of these, 1 - rest.
    const vec3 of_shadow = w.along * w.along * w.own;
    const float mean_share = dot(of_shadow, w.share);
    const vec3 by_wider = by_log_scale + by_opacity * (of_shadow * w.narrower / w.rest - 1.0);
    const bool wide = w.rest > 0.5;
    const vec3 by_shadow = wide ? mean_share - w.share * (1.0 + w.narrower) : w.narrower * w.narrower - w.rest;
    by_log_scale = w.narrower * by_log_scale + by_opacity * (w.share + of_shadow * by_shadow / w.rest);
    const float by_width = dot(w.share, by_wider);
    const vec3 turned = by_opacity * w.along * w.own * (wide ? w.share - mean_share : w.rest - w.narrower) / w.rest;
    torque += cross(turned, w.along);
    by_mean += r.directions * turned / r.eye.z + by_width / r.eye.depth * r.eye.deeper;
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
    const RayShape r = ray_shape(view, quaternion, p2.xyz, p0.w);

    // The mean of an invisible splat may be anything. Zero times a direction that is not finite is not zero.
    const vec3 direction = visible ? normalize(view.offset) : vec3(0.0);
    // max(0, .) passes no gradient where the colour is zero.
    const vec3 shown = fetch(records, RECORD_TEXELS * i + 2u).rgb;
    const vec3 color_sum = vec3(sum[2].zw, sum[3].x);
    const vec3 color_gradient = visible ? color_sum * vec3(greaterThan(shown, vec3(0.0))) : vec3(0.0);
    vec3 direction_gradient;
    const float red_gradient = move_sh(i, color_gradient, direction, direction_gradient);

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
    vec3 torque = beside * scale_ratios(r.log_scale);
    vec3 by_mean = r.directions * (-v * r.sharpness / r.least_scale);
    const bool clamped = KERNEL != KERNEL_DENSITY && sigmoid(p0.w) > float(ALPHA_MAX);
    float logit_gradient = clamped ? 0.0 : by_depth * log_softplus_slope(p0.w);
    if (KERNEL == KERNEL_ANTIALIAS) {
        const float by_opacity = by_depth * (r.peak / ((1.0 - r.peak) * r.depth));
        logit_gradient = clamped ? 0.0 : by_opacity * transparency_of(p0.w);
        narrow(r, widening_of(r.eye, r.directions, computable_log_scale(p2.xyz)), by_opacity, by_log_scale, torque, by_mean);
    }
    const vec3 direction_part = (direction_gradient - direction * dot(direction, direction_gradient)) / length(view.offset);
    const vec3 mean_gradient = transpose(r.eye.rotation) * by_mean + direction_part;

    const vec4 zero = vec4(0.0);
    const bool around = LENSES != 0u && camera.lens != LENS_BROWN;
    move_splat(i, p0, p1, p2, visible ? vec4(mean_gradient, logit_gradient) : zero,
               visible ? torque_on_quaternion(quaternion, torque) / norm : zero, visible ? vec4(by_log_scale, red_gradient) : zero,
               sigmoid(p0.w), visible ? r.eye.depth : 3.4e38,
               visible && around ? log(float(WIDEST_SHARE) * r.eye.depth) : 3.4e38);
    count_updates();
    if (STATISTICS && visible) {
        const vec2 by_pixel = by_mean.xy * r.eye.z / vec2(camera.focal_hi[0], camera.focal_hi[1]);
        const float seen = length(by_pixel * vec2(push.half_size[0], push.half_size[1]));
        if (is_finite(seen)) statistics[i] += vec2(seen, 1.0);
    }
}
