#version 460
// SPDX-License-Identifier: Apache-2.0
// One Adam step of the sky, at the end of a step of training.
// One invocation owns one float of a texel. It reads the views' gradients of the step and a copy of the sky, and updates value
// and moments. The gradient is the mean of the views', with a weak pull towards the neighbours: it reaches texels that no image
// shows.
// An update that is not finite is dropped and counted. A frame whose instances did not fit changes nothing.
#extension GL_GOOGLE_include_directive : require
#include "lib/prelude.glsl"
#include "lib/sky.glsl"

layout(local_size_x_id = SPEC_GROUP_SIZE) in;
layout(set = 0, binding = 0, scalar) readonly buffer Slots { int slots[]; };
layout(set = 0, binding = 1, scalar) readonly buffer Before { float before[]; };
layout(set = 0, binding = 2, scalar) buffer Values { float values[]; };
layout(set = 0, binding = 3, scalar) buffer Moments1 { float moments1[]; };
layout(set = 0, binding = 4, scalar) buffer Moments2 { float moments2[]; };
layout(set = 0, binding = 5, scalar) buffer CountsBlock { Counts counts; };
layout(push_constant, scalar) uniform Push { SkyUpdatePush push; };
#include "lib/table_step.glsl"

float neighbour(ivec2 at, uint channel) { return before[3u * sky_texel(at, push.size) + channel]; }

void main() {
    const uint i = item_index(), floats = 3u * push.size * push.size;
    if (i >= floats || counts.instances > push.instance_capacity) return;
    float sum = 0.0;
    for (uint view = 0u; view < push.views; ++view) sum += float(slots[floats * view + i]);
    const uint channel = i % 3u;
    const ivec2 at = ivec2(i / 3u % push.size, i / 3u / push.size);
    const float apart = 4.0 * before[i] - neighbour(at + ivec2(1, 0), channel) - neighbour(at - ivec2(1, 0), channel) -
                        neighbour(at + ivec2(0, 1), channel) - neighbour(at - ivec2(0, 1), channel);
    const float gradient = sum / (float(SKY_UNITS) * float(push.views)) + float(SKY_PULL) * apart;
    table_step(i, gradient, push.rate, vec2(push.bias1, push.bias2));
}
