#version 460
// SPDX-License-Identifier: Apache-2.0
// The camera of a training image, moved by what training has learned of it.
// One invocation reads the camera of the dataset and its motion, and writes the camera that the frame uses. Sums are of float
// pairs: a motion of zero gives the camera itself, and the moved one is as precise.
#extension GL_GOOGLE_include_directive : require
#define BINDING_CAMERA 0
#include "lib/prelude.glsl"
#include "lib/camera.glsl"
#include "lib/motion.glsl"
#include "lib/subgroup.glsl"

layout(local_size_x_id = SPEC_GROUP_SIZE) in;
layout(set = 0, binding = 1, scalar) readonly buffer Motions { vec4 motions[]; };
layout(set = 0, binding = 2, scalar) writeonly buffer Moved { CameraBlock moved; };
layout(push_constant, scalar) uniform Push { MoveCameraPush push; };

// Adds what is learned of the readout's motion.
void move_readout(inout CameraBlock block) {
    vec3 turn = vec3(camera.readout_turn[0], camera.readout_turn[1], camera.readout_turn[2]) + motions[MOTION_TEXELS * push.readout].xyz;
    turn *= min(1.0, float(READOUT_TURN_LEARNED) / max(length(turn), 1e-3));
    const vec3 shift = motions[MOTION_TEXELS * push.readout + 1u].xyz;
    [[unroll]] for (int i = 0; i < 3; ++i) {
        block.readout_turn[i] = turn[i];
        block.readout_shift[i] = camera.readout_shift[i] + shift[i];
    }
}

void main() {
    if (LANE != 0u) return;
    const vec4 first = motions[MOTION_TEXELS * push.motion];
    const vec3 shift = motions[MOTION_TEXELS * push.motion + 1u].xyz;
    const float focal_change = exp(first.w) - 1.0;
    const mat3 rotation = camera_rotation();
    const vec3 away = transpose(rotation) * shift;
    CameraBlock block = camera;
    [[unroll]] for (int j = 0; j < 3; ++j) {
        const vec3 change = turned_by(first.xyz, rotation[j]);
        [[unroll]] for (int i = 0; i < 3; ++i) {
            const vec2 sum = df_add(vec2(camera.rotation_hi[3 * i + j], camera.rotation_lo[3 * i + j]), vec2(change[i], 0.0));
            block.rotation_hi[3 * i + j] = sum.x;
            block.rotation_lo[3 * i + j] = sum.y;
        }
        const vec2 sum = df_add(vec2(camera.position_hi[j], camera.position_lo[j]), vec2(away[j], 0.0));
        block.position_hi[j] = sum.x;
        block.position_lo[j] = sum.y;
    }
    [[unroll]] for (int i = 0; i < 2; ++i) {
        const vec2 focal = vec2(camera.focal_hi[i], camera.focal_lo[i]);
        const vec2 sum = df_add(focal, vec2(focal.x * focal_change, 0.0));
        block.focal_hi[i] = sum.x;
        block.focal_lo[i] = sum.y;
        // The bounds are lengths in px divided by the focal length.
        block.tan_min[i] = camera.tan_min[i] / (1.0 + focal_change);
        block.tan_max[i] = camera.tan_max[i] / (1.0 + focal_change);
    }
    if (push.readout != push.motion) move_readout(block);
    moved = block;
}
