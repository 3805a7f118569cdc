#version 460
// SPDX-License-Identifier: Apache-2.0
// Makes the records of 2D Gaussians that come as arrays.
// One invocation owns splat i. It reads its entry of each array, and writes its record, its depth key and the number of
// tiles that it reaches; with COLLECT_LISTED it reads that number. A skipped splat gets count 0 and the last key.
// SPEC_MODE: COLLECT_* bits and SHAPE_WHITENERS.
#extension GL_GOOGLE_include_directive : require
#include "lib/prelude.glsl"
#include "lib/double_float.glsl"
#include "lib/footprint.glsl"

layout(local_size_x_id = SPEC_GROUP_SIZE) in;
layout(constant_id = SPEC_MODE) const uint MODE = 0;
const bool FEATURES_ALONE = (MODE & COLLECT_FEATURES) != 0u, WITH_RADII = (MODE & COLLECT_RADII) != 0u,
           LISTED = (MODE & COLLECT_LISTED) != 0u, WHITENERS = (MODE & SHAPE_WHITENERS) != 0u;

layout(set = 0, binding = 0, scalar) readonly buffer Means { vec2 means[]; };
layout(set = 0, binding = 1, scalar) readonly buffer Shapes { vec3 shapes[]; };
layout(set = 0, binding = 2, scalar) readonly buffer Opacities { float opacities[]; };
layout(set = 0, binding = 3, scalar) readonly buffer Features { float features[]; };
layout(set = 0, binding = 4, scalar) readonly buffer Depths { float depths[]; };
layout(set = 0, binding = 5, scalar) readonly buffer Radii { ivec2 radii[]; };
STORED_TEXELS(6, records);
layout(set = 0, binding = 7, scalar) writeonly buffer DepthKeys { uint depth_keys[]; };
layout(set = 0, binding = 8, scalar) buffer TileCounts { uint tile_counts[]; };
layout(set = 0, binding = 9, scalar) buffer CountsBlock { Counts counts; };
layout(push_constant, scalar) uniform Push { CollectPush push; };

// (ux, k, vy) of the inverse covariance [A B; B C]: A = 2 ux^2, B = -2 k ux^2, C = 2 (k^2 ux^2 + vy^2). The
// determinant's products nearly cancel for a needle, so they are float pairs.
vec3 whitener_of(vec3 conic) {
    const vec2 det = df_add(two_product(conic.x, conic.z), -two_product(conic.y, conic.y));
    return vec3(sqrt(0.5 * conic.x), -conic.y / conic.x, sqrt(0.5 * det.x / conic.x));
}

// Floats in their order as unsigned words.
uint ordered(float x) {
    const uint bits = floatBitsToUint(x);
    return (bits & 0x80000000u) != 0u ? ~bits : bits | 0x80000000u;
}

// Tests all channels: a splat with a colour that is not finite is skipped. Some drivers stop a loop after 65,535 iterations.
bool has_finite_features(uint i) {
    bool finite = true;
    for (uint first = 0u; first < push.channels; first += 4u) {
        [[unroll]] for (uint c = 0; c < 4; ++c) {
            const uint channel = min(first + c, push.channels - 1u);
            finite = finite && abs(features[push.channels * i + channel]) <= float(COLOR_MAX);
        }
    }
    return finite;
}

void main() {
    const uint i = item_index();
    if (i >= push.splats) return;
    // Zero times a value that is not finite is not zero: such a feature would spread over its tiles.
    vec4 feature = vec4(0.0);
    [[unroll]] for (uint c = 0; c < 4; ++c) {
        if (push.first_channel + c < push.channels) {
            const float value = features[push.channels * i + push.first_channel + c];
            feature[c] = abs(value) <= float(COLOR_MAX) ? value : 0.0;
        }
    }
    records[RECORD_TEXELS * i + 2] = as_texel(feature);
    if (FEATURES_ALONE) return;

    const vec2 mean = means[i];
    const vec3 shape = WHITENERS ? shapes[i] : whitener_of(shapes[i]);
    const float opacity = opacities[i], depth = LISTED ? 0.0 : depths[i];
    // A splat that no tile lists may hold anything.
    const bool wanted = LISTED ? tile_counts[i] > 0u : !WITH_RADII || (radii[i].x > 0 && radii[i].y > 0);
    // A NaN fails these comparisons.
    const bool finite = has_finite_features(i) && is_finite(mean.x) && is_finite(mean.y) && is_finite(shape) &&
                        shape.x > 0.0 && shape.z > 0.0 && is_finite(opacity) && is_finite(depth);
    const vec4 record0 = vec4(mean, 0.0, 0.0), record1 = vec4(shape, opacity);
    records[RECORD_TEXELS * i] = as_texel(finite ? record0 : vec4(0.0));
    records[RECORD_TEXELS * i + 1] = as_texel(finite ? record1 : vec4(1.0, 0.0, 1.0, 0.0));
    if (wanted && !finite) atomicAdd(counts.skipped_nonfinite, 1u);
    if (LISTED) return;

    uint count = 0u;
    if (wanted && finite) {
        const uvec2 size = uvec2(push.size[0], push.size[1]);
        const Footprint f = footprint_of(record0, record1, size);
        count = count_tiles(f, f.row_begin, f.row_end, size);
    }
    depth_keys[i] = count > 0u ? ordered(depth) : 0xffffffffu;
    tile_counts[i] = count;
}
