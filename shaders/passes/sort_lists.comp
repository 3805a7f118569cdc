#version 460
// SPDX-License-Identifier: Apache-2.0
// Sorts each list of instances by depth, and instances of equal depth by their numbers.
// One workgroup owns a list. Blocks of LIST_BLOCK instances are sorted in shared memory. A longer list is merged in device memory.
// This is a bitonic sort whose comparisons all put the smaller one first: the first step of a merge compares a place with its
// mirror image. Then places behind the end need no values (Knuth, The Art of Computer Programming, volume 3, section 5.3.4).
// SPEC_MODE: LISTS_*, which says what is written for a sorted instance.
#extension GL_GOOGLE_include_directive : require
#include "lib/prelude.glsl"

layout(local_size_x_id = SPEC_GROUP_SIZE) in;
layout(constant_id = SPEC_MODE) const uint MODE = 0;
layout(set = 0, binding = 0, scalar) readonly buffer TileStarts { uint tile_starts[]; };
layout(set = 0, binding = 1, scalar) coherent buffer Keys { uint keys[]; };
layout(set = 0, binding = 2, scalar) coherent buffer Instances { uint instances[]; };  // numbers; the splats replace them
layout(set = 0, binding = 3, scalar) readonly buffer Splats { uint splats[]; };        // as emitted
layout(set = 0, binding = 4, scalar) writeonly buffer Places { uint places[]; };
layout(push_constant, scalar) uniform Push { ListPush push; };

shared uint block_keys[LIST_BLOCK], block_instances[LIST_BLOCK];

// A step compares pairs of places in runs of two times `stride` places. The last run may end early.
uint pairs_of(uint stride, uint count) {
    const uint in_last_run = count & (2u * stride - 1u);
    return (count - in_last_run) / 2u + min(in_last_run, stride);
}
// The places of a pair. With `mirrored` they are mirror images in their run, else `stride` apart.
uint low_of(uint pair, uint stride) { return 2u * (pair & ~(stride - 1u)) + (pair & (stride - 1u)); }
uint high_of(uint low, uint stride, bool mirrored) { return mirrored ? low ^ (2u * stride - 1u) : low + stride; }
bool is_after(uint key, uint instance, uint other_key, uint other) {
    return key > other_key || key == other_key && instance > other;
}

// What invocations have written into device memory before, all read after.
void meet() {
    memoryBarrierBuffer();
    barrier();
    memoryBarrierBuffer();
}

// A step over a block in shared memory with `count` instances.
void block_step(uint stride, bool mirrored, uint count) {
    const uint pairs = pairs_of(stride, count);
    for (uint pair = gl_LocalInvocationID.x; pair < pairs; pair += GROUP_SIZE) {
        const uint low = low_of(pair, stride), high = high_of(low, stride, mirrored);
        if (high >= count) continue;
        const uint key = block_keys[low], other_key = block_keys[high];
        const uint instance = block_instances[low], other = block_instances[high];
        if (!is_after(key, instance, other_key, other)) continue;
        block_keys[low] = other_key;
        block_keys[high] = key;
        block_instances[low] = other;
        block_instances[high] = instance;
    }
    barrier();
}

// The same in device memory, for a list that begins at `begin`.
void list_step(uint stride, bool mirrored, uint begin, uint count) {
    const uint pairs = pairs_of(stride, count);
    for (uint pair = gl_LocalInvocationID.x; pair < pairs; pair += GROUP_SIZE) {
        const uint low = low_of(pair, stride), high = high_of(low, stride, mirrored);
        if (high >= count) continue;
        const uint key = keys[begin + low], other_key = keys[begin + high];
        const uint instance = instances[begin + low], other = instances[begin + high];
        if (!is_after(key, instance, other_key, other)) continue;
        keys[begin + low] = other_key;
        keys[begin + high] = key;
        instances[begin + low] = other;
        instances[begin + high] = instance;
    }
    meet();
}

void load_block(uint begin, uint count) {
    for (uint i = gl_LocalInvocationID.x; i < count; i += GROUP_SIZE) {
        block_keys[i] = keys[begin + i];
        block_instances[i] = instances[begin + i];
    }
    barrier();
}

void store_block(uint begin, uint count) {
    for (uint i = gl_LocalInvocationID.x; i < count; i += GROUP_SIZE) {
        keys[begin + i] = block_keys[i];
        instances[begin + i] = block_instances[i];
    }
    meet();
}

// Merges within a block, or its runs of 2^bits places: steps with strides of 2^(bits - 1) down to 1.
void merge_block(uint bits, uint count) {
    for (uint k = 0u; k < bits; ++k) block_step(1u << (bits - 1u - k), false, count);
}

void sort_block(uint count) {
    for (uint k = 0u; k < LIST_BLOCK_BITS && (1u << k) < count; ++k) {
        block_step(1u << k, true, count);
        merge_block(k, count);
    }
}

void sort_long_list(uint begin, uint count) {
    for (uint first = 0u; first < count; first += LIST_BLOCK) {
        const uint size = min(count - first, LIST_BLOCK);
        load_block(begin + first, size);
        sort_block(size);
        store_block(begin + first, size);
    }
    for (uint bits = LIST_BLOCK_BITS; bits < 31u && (1u << bits) < count; ++bits) {
        list_step(1u << bits, true, begin, count);
        for (uint k = LIST_BLOCK_BITS; k < bits; ++k) list_step(1u << (bits - 1u + LIST_BLOCK_BITS - k), false, begin, count);
        for (uint first = 0u; first < count; first += LIST_BLOCK) {
            const uint size = min(count - first, LIST_BLOCK);
            load_block(begin + first, size);
            merge_block(LIST_BLOCK_BITS, size);
            store_block(begin + first, size);
        }
    }
}

void write(uint at, uint instance) {
    instances[at] = MODE == LISTS_EMITTED ? instance : splats[instance];
    if (MODE == LISTS_TRACKED) places[instance] = at;
}

void main() {
    const uint tile = gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x;
    if (tile > push.tiles) return;
    const uint begin = tile_starts[tile], count = tile_starts[tile + 1u] - begin;
    if (count > LIST_BLOCK) {
        sort_long_list(begin, count);
        for (uint i = gl_LocalInvocationID.x; i < count; i += GROUP_SIZE) write(begin + i, instances[begin + i]);
    } else {
        load_block(begin, count);
        sort_block(count);
        for (uint i = gl_LocalInvocationID.x; i < count; i += GROUP_SIZE) write(begin + i, block_instances[i]);
    }
}
