#version 460
// SPDX-License-Identifier: Apache-2.0
// Exclusive prefix sum of the lists' lengths, in place: where each list begins. There are tiles + 1 lists. The last is of the
// sentinel tile. The same is written to tile_starts, whose entry tiles + 1 is the end of the last list.
// One workgroup does all of it. In a turn an invocation owns SCANNED_LISTS entries side by side, one sector of a GPU's memory.
#extension GL_GOOGLE_include_directive : require
#include "lib/prelude.glsl"

layout(local_size_x_id = SPEC_GROUP_SIZE) in;
layout(set = 0, binding = 0, scalar) buffer Lists { uint lists[]; };
layout(set = 0, binding = 1, scalar) writeonly buffer TileStarts { uint tile_starts[]; };
layout(push_constant, scalar) uniform Push { ListPush push; };

const uint SCANNED_LISTS = 8u, TURN = GROUP_SIZE * SCANNED_LISTS;
shared uint sums[GROUP_SIZE];

void main() {
    const uint thread = gl_LocalInvocationID.x, count = push.tiles + 1u;
    uint carry = 0u;
    for (uint base = 0u; base < count; base += TURN) {
        const uint first = base + thread * SCANNED_LISTS;
        uint length[SCANNED_LISTS], own = 0u;
        [[unroll]] for (uint i = 0; i < SCANNED_LISTS; ++i) {
            length[i] = 0u;
            if (first + i < count) length[i] = lists[first + i];
        }
        [[unroll]] for (uint i = 0; i < SCANNED_LISTS; ++i) own += length[i];
        sums[thread] = own;
        barrier();
        for (uint k = 0u; k < 16u && (1u << k) < GROUP_SIZE; ++k) {
            const uint distance = 1u << k, below = thread >= distance ? sums[thread - distance] : 0u;
            barrier();
            sums[thread] += below;
            barrier();
        }
        uint begin = carry + sums[thread] - own;
        carry += sums[GROUP_SIZE - 1u];
        barrier();
        [[unroll]] for (uint i = 0; i < SCANNED_LISTS; ++i) {
            if (first + i < count) {
                lists[first + i] = begin;
                tile_starts[first + i] = begin;
            }
            begin += length[i];
        }
    }
    if (thread == 0u) tile_starts[count] = carry;
}
