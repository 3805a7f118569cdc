#version 460
// SPDX-License-Identifier: Apache-2.0
// Gradient of the projection, fused with Adam: no buffer holds the gradient of all parameters.
// One invocation owns splat i. It reads the splat's slots in the order of its tiles, its record and its parameters. It
// adds the slots, carries the sums back through the projection, and writes parameters and moments.
// A splat that is not visible has gradient zero, and its moments still move it. A step that is too long for its splat
// is shortened and counted. An update that is not finite is dropped and counted. A frame whose instances did not fit
// changes nothing: the host repeats it. With UPDATE_MOTION each subgroup adds the gradient by the camera's motion over its
// splats, and reduce.comp adds the subgroups. SPEC_MODE: UPDATE_* bits.
// A gradient without a step, and moments in float32, are stored by their bits.
#extension GL_GOOGLE_include_directive : require
#define BINDING_CAMERA 1
#include "lib/prelude.glsl"
#include "lib/params.glsl"
#include "lib/stored_splat.glsl"
#include "lib/footprint_gradient.glsl"
#include "lib/splat_gradient.glsl"
#include "lib/motion.glsl"
#include "lib/subgroup.glsl"

layout(local_size_x_id = SPEC_GROUP_SIZE) in;
layout(constant_id = SPEC_SH_DEGREE) const uint SH_DEGREE = 3;
layout(constant_id = SPEC_MODE) const uint MODE = 0;
const bool GRADIENT_ONLY = (MODE & UPDATE_GRADIENT_ONLY) != 0u, MOTION = (MODE & UPDATE_MOTION) != 0u,
           BY_DEPTH_PLANE = (MODE & UPDATE_DEPTH) != 0u;

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
layout(set = 0, binding = 15, scalar) writeonly buffer MotionSums { float motion_sums[]; };
#include "lib/slots.glsl"
#include "lib/splat_update.glsl"

// A splat's share of the gradient by the camera's motion, in the order of a motion's floats. Rotation and shift are
// relative to the moved camera.
struct MotionGradient {
    vec4 first;
    vec3 shift;
};

struct MotionGradients {
    MotionGradient pose, readout;
};
const MotionGradient NO_MOTION = MotionGradient(vec4(0.0), vec3(0.0));
const MotionGradients NO_MOTIONS = MotionGradients(NO_MOTION, NO_MOTION);

// The rotation turns the splat's position and axes, as the camera sees them, and the direction of parallel rays. The shift moves
// the mean the other way.
MotionGradient pose_gradient(FootprintGradient f, StoredProjection stored, SplatGradient g, vec3 direction_gradient) {
    const Projection p = stored.footprint;
    const vec3 axes_torque = camera_rotation() * (rotation_of(stored.unit_quaternion) * g.torque);
    vec3 turn = cross(point_of(p.view), g.view) + axes_torque;
    if (LENSES != 0u && camera.lens == LENS_ORTHOGRAPHIC) turn += cross(camera_rotation() * direction_gradient, vec3(0.0, 0.0, 1.0));
    return MotionGradient(vec4(turn, LENSES != 0u ? lens_focal_gradient(f, p) : focal_gradient(f, p)), -(camera_rotation() * g.mean));
}

// The same through a rolling shutter, and by its motion. With the time t, R = exp(t turn) and the point p in the middle,
//   y = R (p - t shift) and v = turn x y - R shift.
MotionGradients rolling_gradient(StoredProjection stored, SplatGradient g) {
    const Projection p = stored.footprint;
    const float time = p.readout.time;
    const mat3 back = transpose(readout_rotation(time));
    const vec3 position = point_of(p.view), by_middle = camera_rotation() * g.mean;
    const vec3 torque = cross(position, g.view) + seen_rotation(p) * (rotation_of(stored.unit_quaternion) * g.torque);
    const vec3 later = torque - cross(readout_shift_at(time), g.motion);
    return MotionGradients(
        MotionGradient(vec4(back * torque + time * cross(readout_shift(), by_middle), 0.0), -by_middle),
        MotionGradient(vec4(time * turn_gradient(time * readout_turn(), later) + cross(position, g.motion), 0.0),
                       -(time * by_middle + back * g.motion)));
}

// All lanes take part in the sums, with or without a splat.
void write_motion_sums(MotionGradient own, uint first_row) {
    const uint subgroups = gl_NumWorkGroups.x * gl_NumWorkGroups.y * (GROUP_SIZE / SUBGROUP);
    const uint at = (gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x) * (GROUP_SIZE / SUBGROUP) + SUBGROUP_INDEX;
    [[unroll]] for (uint row = 0; row < MOTION_VALUES; ++row) {
        const float sum = subgroup_sum(row < 4u ? own.first[row % 4u] : own.shift[(row + 2u) % 3u]);
        if (LANE == 0u) motion_sums[(first_row + row) * subgroups + at] = sum;
    }
}

bool all_finite(MotionGradient g) { return is_finite(g.first) && is_finite(g.shift); }

// Returns the gradient by the camera's motion.
MotionGradients update_splat(uint i) {
    const uint count = tile_counts[i];
    const bool visible = count > 0u;
    const vec4 p0 = fetch(params, index_of(0, i)), p1 = fetch(params, index_of(1, i)),
               p2 = fetch(params, index_of(2, i));
    vec4 sum[SLOT_TEXELS];
    sum_slots(visible ? first_instances[i] : 0u, count, ABSOLUTE || BY_DEPTH_PLANE, sum);
    Sums s = Sums(sum[0].x, sum[0].yz, vec3(sum[0].w, sum[1].xy), vec3(sum[1].zw, sum[2].x), sum[2].yz, sum[2].w);
    const StoredSplat splat = StoredSplat(p0.xyz, p0.w, p1, p2.xyz);
    const StoredProjection stored = project_splat(splat);
    const Projection p = stored.footprint;
    cut_off_gradient(stored, s);
    // The mean of an invisible splat may be anything. Zero times a direction that is not finite is not zero.
    const vec3 direction = visible ? seen_along(p) : vec3(0.0);
    // max(0, .) passes no gradient where the colour is zero.
    const vec3 shown = fetch(records, RECORD_TEXELS * i + 2u).rgb;
    const vec3 color_gradient = visible ? s.color * vec3(greaterThan(shown, vec3(0.0))) : vec3(0.0);
    vec3 direction_gradient;
    const float red_gradient = move_sh(i, color_gradient, direction, direction_gradient);

    const FootprintGradient f = footprint_gradient(s, p);
    SplatGradient g = splat_gradient(f, stored, splat, s.g, direction, direction_gradient);
    if (BY_DEPTH_PLANE) add_depth_gradient(g, s.depth);
    const float depth = visible ? depth_of_splat(p) : 3.4e38;

    const vec4 zero = vec4(0.0);
    move_splat(i, p0, p1, p2, visible ? vec4(g.mean, g.logit) : zero, visible ? g.quaternion : zero,
               visible ? vec4(g.log_scale, red_gradient) : zero,
               KERNEL == KERNEL_DENSITY ? sigmoid(p0.w) : stored.peak, depth, visible ? widest_log_scale(p) : 3.4e38);
    if (STATISTICS && visible) statistics[i] += statistics_of(f, vec2(push.half_size[0], push.half_size[1]));
    if (!MOTION || !visible) return NO_MOTIONS;
    MotionGradients motion = NO_MOTIONS;
    if (ROLLING)
        motion = rolling_gradient(stored, g);
    else
        motion.pose = pose_gradient(f, stored, g, direction_gradient);
    // One splat's gradient that is not finite leaves those of the others.
    if (all_finite(motion.pose) && all_finite(motion.readout)) return motion;
    return NO_MOTIONS;
}

void main() {
    if (counts.instances > push.instance_capacity) return;
    const uint i = item_index();
    MotionGradients motion = NO_MOTIONS;
    if (i < push.splats) motion = update_splat(i);
    count_updates();
    if (MOTION) write_motion_sums(motion.pose, 0u);
    if (MOTION && ROLLING) write_motion_sums(motion.readout, MOTION_VALUES);
}
