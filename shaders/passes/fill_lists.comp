#version 460
// SPDX-License-Identifier: Apache-2.0
// Puts the emitted instances into the lists of their tiles, in any order: sort_lists.comp brings them into one.
// One invocation owns instance e. It writes e and the depth key of its splat. `lists` has the place of each list's next
// instance, at first where the list begins.
#extension GL_GOOGLE_include_directive : require
#include "lib/prelude.glsl"

layout(local_size_x_id = SPEC_GROUP_SIZE) in;
layout(set = 0, binding = 0, scalar) readonly buffer Tiles { uint tiles[]; };
layout(set = 0, binding = 1, scalar) readonly buffer Splats { uint splats[]; };
layout(set = 0, binding = 2, scalar) readonly buffer DepthKeys { uint depth_keys[]; };
layout(set = 0, binding = 3, scalar) readonly buffer CountsBlock { Counts counts; };
layout(set = 0, binding = 4, scalar) buffer Lists { uint lists[]; };
layout(set = 0, binding = 5, scalar) writeonly buffer Keys { uint keys[]; };
layout(set = 0, binding = 6, scalar) writeonly buffer Instances { uint instances[]; };
layout(push_constant, scalar) uniform Push { ListPush push; };

void main() {
    const uint e = item_index();
    if (e >= counts.instances || counts.instances > push.capacity) return;
    const uint splat = splats[e] & ((1u << PART_SHIFT) - 1u);
    const uint at = atomicAdd(lists[tiles[e]], 1u);
    keys[at] = depth_keys[splat];
    instances[at] = e;
}
