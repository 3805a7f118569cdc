#version 460
// SPDX-License-Identifier: Apache-2.0
// Projects splats into pixels.
// One invocation owns splat i. It reads its parameters and the camera, and writes its record, its depth key and the
// number of tiles that it reaches. A splat that is not visible gets count 0 and the last key.
// SPEC_MODE, bits: PROJECT_DEBUG shifts the scales and counts the visible splats; PROJECT_NORMALS and PROJECT_SLOPES write
// the splat's surface in place of its colour; PROJECT_MARKS hides and tints splats by their marks.
#extension GL_GOOGLE_include_directive : require
#define BINDING_CAMERA 1
#include "lib/prelude.glsl"
#include "lib/params.glsl"
#include "lib/stored_splat.glsl"
#include "lib/footprint.glsl"
#include "lib/subgroup.glsl"
#include "lib/surface.glsl"

layout(local_size_x_id = SPEC_GROUP_SIZE) in;
layout(constant_id = SPEC_SH_DEGREE) const uint SH_DEGREE = 3;
layout(constant_id = SPEC_MODE) const uint MODE = 0;
const bool DEBUG = (MODE & PROJECT_DEBUG) != 0u;

TEXELS(0, params);
STORED_TEXELS(2, records);
layout(set = 0, binding = 3, scalar) writeonly buffer DepthKeys { uint depth_keys[]; };
layout(set = 0, binding = 4, scalar) writeonly buffer TileCounts { uint tile_counts[]; };
layout(set = 0, binding = 5, scalar) buffer CountsBlock { Counts counts; };
layout(push_constant, scalar) uniform Push { ProjectPush push; };
#include "lib/splat_color.glsl"
#include "lib/marks.glsl"

// Whether splat i reaches a tile.
bool project(uint i) {
    const uint mark = mark_of(i);
    if ((mark & push.hidden_marks) != 0u) {
        depth_keys[i] = 0xffffffffu;
        tile_counts[i] = 0u;
        return false;
    }
    const vec4 p0 = param(0, i), p1 = param(1, i), p2 = param(2, i);
    const vec3 log_scale = DEBUG ? p2.xyz + push.log_scale_shift : p2.xyz;
    const StoredProjection stored = project_splat(StoredSplat(p0.xyz, p0.w, p1, log_scale));
    const Projection p = stored.footprint;
    const float z = depth_of_splat(p);
    bool finite_color;
    vec3 color = sh_color(i, p2, seen_along(p), finite_color);
    if (MARKED) color = tinted(color, mark & push.tinted_marks);
    if ((MODE & PROJECT_NORMALS) != 0u) color = normal_of(p);
    if ((MODE & PROJECT_SLOPES) != 0u) color = vec3(depth_slopes(p), 0.0);

    float opacity = shown_opacity(stored.peak * p.factor, mark & push.tinted_marks);
    // A NaN stays one.
    if (KERNEL == KERNEL_DENSITY) opacity = opacity > float(DEPTH_MAX) ? float(DEPTH_MAX) : opacity;
    const bool lens = LENSES != 0u;
    const vec2 x = lens ? pixel_in_plane(p.image.x, 0) : pixel_position(p.view.x, p.view.z, 0);
    const vec2 y = lens ? pixel_in_plane(p.image.y, 1) : pixel_position(p.view.y, p.view.z, 1);
    const vec4 record0 = vec4(x.x, y.x, x.y, y.y), record1 = vec4(p.ux, p.k, p.vy, opacity);
    const uvec2 size = uvec2(camera.size[0], camera.size[1]);

    const bool stored_finite = is_finite(p0) && is_finite(p1) && is_finite(p2.xyz) && stored.in_range;
    const bool in_front = z > float(NEAR_PLANE) && (LENSES == 0u || p.image.shown);
    const bool projected_finite = p.footprint_in_range && finite_color && is_finite(record0) && is_finite(record1) && p.ux > 0.0 && p.vy > 0.0;
    bool visible = stored_finite && in_front && projected_finite;
    // Footprints reach to an optical depth of CUT_OFF: that is a little further than an opacity of CUT_OFF.
    if (KERNEL == KERNEL_DENSITY) visible = visible && opacity >= depth_of(CUT_OFF);

    uint count = 0u;
    if (visible) {
        const Footprint f = footprint_of(record0, record1, size);
        count = count_tiles(f, f.row_begin, f.row_end, size);
    }
    records[RECORD_TEXELS * i] = as_texel(record0);
    records[RECORD_TEXELS * i + 1] = as_texel(record1);
    records[RECORD_TEXELS * i + 2] = as_texel(vec4(color, z));
    depth_keys[i] = count > 0u ? floatBitsToUint(z) : 0xffffffffu;
    tile_counts[i] = count;
    if (!stored_finite || (in_front && !projected_finite)) atomicAdd(counts.skipped_nonfinite, 1u);
    return count > 0u;
}

void main() {
    const uint i = item_index();
    bool visible = false;
    if (i < push.splats) visible = project(i);
    if (DEBUG) {
        // One atomic a subgroup. All lanes take part in the sum, with or without a splat.
        const uint sum = subgroup_inclusive_sum(visible ? 1u : 0u);
        if (LANE == SUBGROUP - 1u && sum > 0u) atomicAdd(counts.visible, sum);
    }
}
