// SPDX-License-Identifier: Apache-2.0
// Every block that host and shaders share, under the scalar block layout. src/passes/layout_checks.cpp
// asserts sizes.
#ifndef EWA_SHARED_LAYOUTS_H
#define EWA_SHARED_LAYOUTS_H
#include "glue.h"
EWA_BEGIN_SHARED

// ---- Specialisation constants, the same id in every shader that has one ----
EWA_UINT(SPEC_GROUP_SIZE, 0u);  // invocations a workgroup
EWA_UINT(SPEC_SUBGROUP, 1u);    // lanes a subgroup
EWA_UINT(SPEC_TILE_WIDTH, 2u);  // px; tile width * tile height is a multiple of the subgroup
EWA_UINT(SPEC_TILE_HEIGHT, 3u);
EWA_UINT(SPEC_SH_DEGREE, 4u);   // 0..3, the degree evaluated
EWA_UINT(SPEC_KERNEL, 5u);      // KERNEL_*
EWA_UINT(SPEC_MODE, 6u);        // per shader, see there
EWA_UINT(SPEC_RADIX_BITS, 7u);  // bits a radix pass sorts by, 1..8
EWA_UINT(SPEC_CUT_OFF, 8u);     // ALPHA_MIN, or another least contribution (a float)

// ---- A splat's parameters: flat float f stands in component f % 4 of texel plane f / 4. Splats are stored
// in blocks of PARAM_BLOCK, within a block plane after plane: one line of memory holds one plane of a block,
// and all that a block has stands side by side (see lib/params.glsl). Adam's two moments and gradients have
// the same layout. ----
EWA_UINT(PARAM_BLOCK, 8u);
EWA_UINT(PARAM_MEAN, 0u);        // 3 floats, world units
EWA_UINT(PARAM_OPACITY, 3u);     // logit
EWA_UINT(PARAM_QUATERNION, 4u);  // w x y z
EWA_UINT(PARAM_LOG_SCALE, 8u);   // 3 floats
EWA_UINT(PARAM_SH, 11u);         // 3 (degree + 1)^2 floats: coefficient after coefficient, RGB inner

// ---- A projected splat: 3 texels at 3 * i ----
// 0: mean in px, high parts x y, low parts x y (their sum is the mean to about 48 bits)
// 1: ux, k, vy, opacity: with d = pixel - mean, u = ux (d.x - k d.y), v = vy d.y, alpha = opacity exp(-(u^2 +
// v^2)).
//    Of the covariance [a b; b c]: ux = sqrt(c / (2 det)), k = b / c, vy = 1 / sqrt(2 c).
// 2: colour r g b, view z
EWA_UINT(RECORD_TEXELS, 3u);

// ---- A gradient slot: what one tile adds to one splat, 12 floats (3 texels) ----
// g = dL/d(power) of a pixel. 0: sum g; 1 2: sum g u, g v; 3 4 5: sum g u^2, g u v, g v^2; 6 7 8:
// dL/d(colour); 9 10, where absolute gradients are asked for: sum |g u|, sum |g (vy v - k ux u)|
EWA_UINT(SLOT_FLOATS, 12u);
EWA_UINT(SLOT_TEXELS, 3u);

// ---- Image planes: plane p of pixel (x, y) is float p * plane_floats + y * stride + x; stride is a multiple
// of 4 ----
EWA_UINT(PLANE_R, 0u);
EWA_UINT(PLANE_G, 1u);
EWA_UINT(PLANE_B, 2u);
EWA_UINT(PLANE_T, 3u);      // transmittance that reaches the background
EWA_UINT(PLANE_DEPTH, 4u);  // sum of z alpha T
EWA_UINT(PLANE_COUNT, 4u);  // splats blended; a picture has one of the two at most

// ---- SPEC_MODE of blend.comp ----
EWA_UINT(BLEND_COLOR, 0u);
EWA_UINT(BLEND_DEPTH, 1u);       // writes PLANE_DEPTH also
EWA_UINT(BLEND_COUNT, 2u);       // writes PLANE_COUNT also
EWA_UINT(BLEND_ELLIPSOIDS, 3u);  // the nearest splat as a solid, in place of blending

// ---- Loss: what one invocation owns. A pass down the columns: one texel (4 pixels) wide, LOSS_ROWS rows
// high; a pass along the rows: LOSS_TEXELS texels of one row. Neighbouring outputs share most of their
// window. ----
EWA_UINT(LOSS_ROWS, 4u);
EWA_UINT(LOSS_TEXELS, 4u);
// ---- Loss planes per colour channel c ----
EWA_UINT(MOMENT_PLANES, 4u);      // of 4 c + 0: mean x; 1: mean y; 2: mean x^2 + y^2; 3: mean x y
EWA_UINT(DERIVATIVE_PLANES, 3u);  // of 3 c + 0: dS/d(mean x); 1: dS/d(mean x^2); 2: dS/d(mean x y)

// ---- Exposure: a photograph's affine map of colours, 3 texels of (row of the matrix, offset) at 3 *
// photograph ----
EWA_UINT(EXPOSURE_FLOATS, 12u);
EWA_UINT(EXPOSURE_TEXELS, 3u);
EWA_UINT(EXPOSURE_BLOCK, 4096u);  // pixels a subgroup sums its gradient over

EWA_UINT(RADIX_DIGITS_MAX, 256u);

struct CameraBlock {
    float rotation_hi[9];  // world to camera, rows; high and low parts of the float64 values
    float rotation_lo[9];
    float position_hi[3];  // camera centre in world coordinates
    float position_lo[3];
    float focal_hi[2];  // px
    float focal_lo[2];
    float center_hi[2];  // principal point, px
    float center_lo[2];
    float tan_min[2];  // bounds of x/z, y/z in the Jacobian
    float tan_max[2];
    uint size[2];  // px
    uint tiles[2];
};

// Written by the device, read back by the host after a submission.
struct Counts {
    uint instances;          // (splat, tile) pairs this frame needs; may exceed the capacity
    uint skipped_nonfinite;  // splats left out because a value is not finite or the quaternion is zero
    uint dropped_updates;    // parameter updates that were not finite
    uint densified;          // splats after densification
    float l1;                // mean |x - y|
    float ssim;              // mean SSIM
    uint limited_steps;      // steps of a mean, quaternion or scale that were shortened
    uint drawn;              // splats that reach a tile; counted where the projection is one for inspection
};

struct ProjectPush {
    uint splats;
    uint planes;            // texel planes stored a splat
    float log_scale_shift;  // inspection: added to every log scale
};

struct SortPush {
    uint items;  // number of items, or 0: Counts.instances, where that does not exceed `capacity`
    uint capacity;
    uint lanes;  // lanes that share the items in contiguous chunks
    uint shift;  // first bit of the digit
};

struct ScanPush {
    uint items;  // entries in all
    uint block;  // entries a subgroup scans
};

struct ScanTotalsPush {
    uint blocks;
    uint write_instances;  // 1: the grand total is Counts.instances
};

struct EmitPush {
    uint splats;
    uint capacity;  // instances there is room for
    uint scan_block;
    uint strip_rows;  // tile rows one lane walks
    uint size[2];     // px
    uint tiles[2];
};

struct TileStartsPush {
    uint tiles;
    uint capacity;
};

struct BlendPush {
    float background[3];
    uint size[2];  // px
    uint stride;   // floats a row
    uint plane_floats;
    uint tiles[2];
    uint tile_step[2];  // tile = workgroup.x * step.x + workgroup.y * step.y
    uint capacity;      // instances there is room for
};

struct UnpackPush {
    float background[3];
    uint size[2];
    uint stride;
    uint plane_floats;
};

struct PackPush {
    uint plane_floats;
};

struct MaskPush {
    uint size[2];
    uint stride;
    uint plane_floats;
};

struct ExposurePush {
    uint size[2];
    uint stride;
    uint plane_floats;
    uint photo;  // whose exposure
};

struct ExposureUpdatePush {
    uint photo;
    uint blocks;  // of partial sums
    float rate;
    float pull;          // d(loss)/d(value) of a value 1 away from that of the identity
    float bias1, bias2;  // 1 / (1 - beta^visit): a photograph's own number of steps
    uint instance_capacity;
};

struct LossPush {
    uint size[2];
    uint stride;
    uint plane_floats;
    float ssim_scale;  // d(loss)/d(SSIM of one pixel and channel)
    float l1_scale;    // d(loss)/d|x - y| of one pixel and channel
};

struct ReducePush {
    uint items;
    uint block;   // items a subgroup adds up
    uint target;  // 0: sums[block number]; 1: Counts.l1; 2: Counts.ssim
    float scale;  // applied to the result
};

struct UpdatePush {
    uint splats;
    uint planes;  // texel planes stored a splat
    uint instance_capacity;
    float mean_rate, opacity_rate, quaternion_rate, scale_rate, sh0_rate, sh_rest_rate;
    float bias1, bias2;  // 1 / (1 - beta^step)
    float half_size[2];  // W / 2, H / 2: px to normalised device coordinates
    float opacity_pull;  // regularisers: d(loss)/d(opacity), d(loss)/d(scale) of every splat
    float scale_pull;
};

struct DensifyPush {
    uint splats;        // of the old buffers
    uint planes;        // texel planes stored a splat
    uint new_capacity;  // splats there is room for in the new buffers
    uint scan_block;
    float grow_gradient;  // threshold of the mean gradient norm
    float split_scale;    // world units; larger than this: split, else clone
    float prune_opacity;  // logit
    float prune_scale;    // world units; 0: do not prune by scale
    uint seed[2];
    uint step;
    uint revised_opacity;  // 1: what a split leaves in one place is as opaque as what it replaced
};

struct ResetPush {
    uint splats;
    uint planes;  // texel planes stored a splat
    float logit;
};

struct McmcPush {
    uint splats, planes;  // before; texel planes stored a splat
    uint new_splats;
    uint scan_block;
    uint dead, draws, total;  // splats to relocate; sources to draw; sum of the weights
    float weight_scale;       // weight of an opacity of 1
    float dead_logit;         // at or under it a splat is dead
    float least_opacity;      // of a splat that shares its source's
    float spread;             // standard deviations of the source that it and its copies move apart
    uint seed[2];
    uint step;
};

struct PerturbPush {
    uint splats, planes;
    uint instance_capacity;
    float amplitude;
    float reach;  // the longest noise (world units)
    uint seed[2];
    uint step;
};

// ---- A mesh scene as rays meet it: buffers of rgba32ui texels that hold floats by their bits ----
// Positions are relative to an origin that the host subtracts in float64 first.
// Node: of each of two children low x y z, reference; high x y z, 0. A reference is a node's number, or a
// leaf's LEAF_FLAG, triangles - 1 in LEAF_COUNT_BITS bits and its first triangle. A child that is none has
// low above high.
EWA_UINT(NODE_TEXELS, 4u);
EWA_UINT(LEAF_FLAG, 0x80000000u);
EWA_UINT(LEAF_COUNT_SHIFT, 28u);
EWA_UINT(LEAF_FIRST_MASK, 0x0fffffffu);
// Triangle: corner 0 x y z, material; corner 1 - corner 0, 0; corner 2 - corner 0, 1 where cameras see its
// back.
EWA_UINT(TRIANGLE_TEXELS, 3u);
// Surface: three normals (octahedral, 2 x snorm16), colour 0; uv 0, uv 1; uv 2, colour 1, colour 2 (RGBA, 4 x
// unorm8).
EWA_UINT(SURFACE_TEXELS, 3u);
// Material: base r g b, opacity; metallic, roughness, F0 of the dielectric, F90 of it; emitted r g b, cut-off
// or 0; textures of base, metal and roughness, emission (NO_TEXTURE: none), MATERIAL_* flags; density of
// light sampling (per area) on its triangles, 0 0 0.
EWA_UINT(MATERIAL_TEXELS, 5u);
EWA_UINT(NO_TEXTURE, 0xffffffffu);
EWA_UINT(MATERIAL_TWO_SIDED, 1u);  // emits on both sides, and cameras see its back
EWA_UINT(MATERIAL_MASKED, 2u);     // is there where its opacity reaches the cut-off
EWA_UINT(MATERIAL_BLENDED, 4u);    // stops a ray with the probability of its opacity
EWA_UINT(MATERIAL_UNLIT, 8u);      // emits its base colour, vertex colours included
// Texture: first texel, width, height, TEXTURE_* flags.
EWA_UINT(WRAP_REPEAT, 0u);
EWA_UINT(WRAP_CLAMP, 1u);
EWA_UINT(WRAP_MIRROR, 2u);
EWA_UINT(TEXTURE_WRAP_T_SHIFT, 2u);
EWA_UINT(TEXTURE_NEAREST, 16u);
// Light: position (directional: direction to it; triangle: 0), LIGHT_* kind; r g b, probability to be drawn;
// spot's direction, range or 0 (triangle: its number); spot's scale and offset, alias threshold, alias.
EWA_UINT(LIGHT_TEXELS, 4u);
EWA_UINT(LIGHT_DIRECTIONAL, 0u);
EWA_UINT(LIGHT_POINT, 1u);
EWA_UINT(LIGHT_SPOT, 2u);
EWA_UINT(LIGHT_TRIANGLE, 3u);
EWA_UINT(SPEC_ALPHA_TESTED, 9u);  // 1: some material is masked or blended

struct TraceView {
    float rotation[9];                       // world to camera, rows
    float position[3];                       // relative to the origin of the triangles
    float focal[2];                          // px
    float center[2];                         // px
    uint size[2];                            // px
    float zenith[3], horizon[3], ground[3];  // radiance of the sky straight up, level and straight down
    float sample_max;                        // radiance
};

// Integer sums, the same in any order.
struct TraceCounts {
    uint unfinished_rays;  // ended by the limit on steps
    uint dropped_samples;  // not finite
};

struct TracePush {
    uint first_sample, samples;  // of a pixel, in this dispatch
    uint max_steps;              // of one ray
    uint lights;
    uint seed[2];
};

EWA_END_SHARED
#endif
