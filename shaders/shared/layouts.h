// SPDX-License-Identifier: Apache-2.0
// Every block that host and shaders share, under the scalar block layout, and every mode and target that both
// name. src/passes/pass.cpp asserts the sizes of the blocks.
#ifndef EWA_SHARED_LAYOUTS_H
#define EWA_SHARED_LAYOUTS_H
#include "glue.h"
EWA_BEGIN_SHARED

// ---- Specialisation constants, the same id in every shader that has one ----
EWA_UINT(SPEC_GROUP_SIZE, 0u);  // invocations a workgroup
EWA_UINT(SPEC_SUBGROUP, 1u);    // lanes a subgroup
EWA_UINT(SPEC_TILE_WIDTH, 2u);  // px; tile width * tile height is a multiple of the subgroup
EWA_UINT(SPEC_TILE_HEIGHT, 3u);
EWA_UINT(SPEC_SH_DEGREE, 4u);      // evaluated degree, 0 to 3
EWA_UINT(SPEC_KERNEL, 5u);         // KERNEL_*
EWA_UINT(SPEC_MODE, 6u);           // one of the shader's modes below, or a sum of its bits
EWA_UINT(SPEC_RADIX_BITS, 7u);     // bits a radix pass sorts by, 1..8
EWA_UINT(SPEC_CUT_OFF, 8u);        // float: contributions below it are skipped; normally ALPHA_MIN
EWA_UINT(SPEC_ALPHA_TESTED, 9u);   // 1: some mesh material is masked or blended
EWA_UINT(SPEC_BROADCAST, 11u);     // BROADCAST_*: how the lanes of a tile read a batch of splats
EWA_UINT(SPEC_SHARP, 12u);         // 1: some footprint is sharper than LOW_PASS leaves any
EWA_UINT(SPEC_COLOR_FLOATS, 10u);  // a buffer of colours holds 0: 4 bytes a colour; 1: 4 floats
EWA_UINT(SPEC_NEAREST, 13u);       // spheres that a pixel draws, at least 1
EWA_UINT(SPEC_PARTS, 14u);         // 1: an instance counts in one part of its tile: see PART_SIZE
EWA_UINT(SPEC_LENSES, 15u);        // LENSES_*: what a camera is
EWA_UINT(SPEC_WRAP, 16u);          // 1: the image's left and right border are one line of the scene
EWA_UINT(SPEC_SLOTS, 17u);         // SLOTS_*: the order of the gradient slots
EWA_UINT(SPEC_QUADS, 18u);  // 0, or four tiles share a list, and this is a batch's size: see QUAD_TILES

// ---- A splat's parameters ----
// Flat float f is component f % 4 of texel plane f / 4. Splats are stored in blocks of PARAM_BLOCK. Within a
// block, plane follows plane: a cache line holds one plane of a block, and a block is contiguous (see
// lib/params.glsl). Gradients and Adam's moments have the same layout, in words: both moments of a value in one word
// (lib/moments.glsl), or a float32 in each of two buffers.
EWA_UINT(PARAM_BLOCK, 8u);
EWA_UINT(PARAM_MEAN, 0u);        // 3 floats, world units
EWA_UINT(PARAM_OPACITY, 3u);     // logit
EWA_UINT(PARAM_QUATERNION, 4u);  // w x y z
EWA_UINT(PARAM_LOG_SCALE, 8u);   // 3 floats
EWA_UINT(PARAM_SH, 11u);         // 3 (degree + 1)^2 floats: coefficient after coefficient, RGB inner

// ---- A projected splat: 3 texels at 3 * i ----
// 0: mean in px, high parts x y, low parts x y (their sum is the mean to about 48 bits)
// 1: ux, k, vy, opacity. With d = pixel - mean:
//    u = ux (d.x - k d.y), v = vy d.y, alpha = opacity exp(-(u^2 + v^2)).
//    With the covariance [a b; b c]: ux = sqrt(c / (2 det)), k = b / c, vy = 1 / sqrt(2 c).
// 2: colour r g b, view z
EWA_UINT(RECORD_TEXELS, 3u);

// ---- A splat's mark, a byte, four in a word. ewa::Mark has all bits; these change the colour ----
EWA_UINT(MARK_SELECTED, 1u);
EWA_UINT(MARK_LOCKED, 2u);
EWA_UINT(MARK_PREVIEW, 16u);

// ---- A splat as rays meet it: 3 texels at 3 * i. Its record's texels 0 and 1 are an ellipse for the tiles' lists ----
// 0: mean in px, as in a record
// 1: ux, k, vy of the footprint without a low-pass, optical depth of the ray through the centre
// 2: g.x, g.y, rho, least view depth of a point that counts. lib/rays.glsl has the formulas.
EWA_UINT(RAY_TEXELS, 3u);

// ---- A gradient slot of rays: 16 floats (4 texels) ----
// W11 W22 W33 W12; W13 W23 V1 V2; V3, dL/d(ln depth), dL/d(colour) r g; b, 0 0 0. lib/rays.glsl defines W and V.
EWA_UINT(RAY_SLOT_FLOATS, 16u);
EWA_UINT(RAY_SLOT_TEXELS, 4u);

// ---- A gradient slot: what one tile adds to one splat's gradient, 12 floats (3 texels) ----
// With g = dL/d(power) of a pixel and sums over the tile's pixels:
// 0: sum g; 1 2: sum g u, g v; 3 4 5: sum g u^2, g u v, g v^2; 6 7 8: dL/d(colour);
// 9 10, with BLEND_BACKWARD_ABSOLUTE: sum |g u|, sum |g (vy v - k ux u)|
// 11, with BLEND_BACKWARD_FOURTH: dL/d(fourth channel)
EWA_UINT(SLOT_FLOATS, 12u);
EWA_UINT(SLOT_TEXELS, 3u);

// ---- A batch of views: each view has a list of the splats that reach a tile of it, in the order of the splats ----
// A view may be cut into bands of tile rows. Then each band has a list.
EWA_UINT(NOT_LISTED, 0xffffffffu);  // list index of a splat that is not in a list
// Sums over the slots of a listed splat: the first 9 floats of a slot, with UPDATE_ABSOLUTE 11, with UPDATE_DEPTH all 12. The
// gradient of a colour that is cut off at 0 is 0.
EWA_UINT(SUM_FLOATS, 9u);
EWA_UINT(SUM_FLOATS_ABSOLUTE, 11u);
EWA_UINT(SUM_FLOATS_DEPTH, 12u);

// ---- An instance for a part of its tile, with SPEC_PARTS ----
// A part is a block of PART_SIZE x PART_SIZE pixels, or of the tile's width. Its number, row by row, is in the bits of
// the instance's splat from PART_SHIFT up. A tile has at most 16 parts.
EWA_UINT(PART_SIZE, 4u);  // px
EWA_UINT(PART_SHIFT, 28u);

// ---- Lists of quads, with SPEC_QUADS: two tiles side by side and the two below them share a list ----
// Bit PART_SHIFT + t of an instance's splat says whether the splat reaches tile t of the quad, row by row. A workgroup has a
// subgroup for each tile. Together they stage a batch of splats, a multiple of the subgroup and at most one an invocation.
EWA_UINT(QUAD_TILES, 4u);
// A splat in a batch has its record, its word, and for each tile a pick and up to 12 sums (lib/tile.glsl, lib/tile_sums.glsl).
EWA_UINT(QUAD_SPLAT_BYTES, 260u);

// ---- Lists that are sorted one by one (sort_lists.comp) ----
EWA_UINT(LIST_BLOCK_BITS, 11u);
EWA_UINT(LIST_BLOCK, 2048u);  // 2^LIST_BLOCK_BITS instances are sorted in shared memory, 8 bytes each

// ---- Image planes ----
// Plane p of pixel (x, y) is float p * plane_floats + y * stride + x.
struct ImageLayout {
    uint size[2];  // px
    uint stride;   // floats a row, a multiple of 4
    uint plane_floats;
};
EWA_UINT(PLANE_R, 0u);
EWA_UINT(PLANE_G, 1u);
EWA_UINT(PLANE_B, 2u);
EWA_UINT(PLANE_T, 3u);       // transmittance that reaches the background
EWA_UINT(PLANE_DEPTH, 4u);   // sum of z alpha T
EWA_UINT(PLANE_COUNT, 4u);   // splats blended; an image has one of these three
EWA_UINT(PLANE_MEDIAN, 4u);  // depth of the splat that takes T to MEDIAN_TRANSMITTANCE or below; 0: none does

// ---- SPEC_MODE ----
// project.comp, bits
EWA_UINT(PROJECT_DEBUG, 1u);    // shifts the scales, and counts the visible splats
EWA_UINT(PROJECT_NORMALS, 2u);  // in place of the colour: the normal in world axes, towards the eye
EWA_UINT(PROJECT_SLOPES, 4u);   // in place of the colour: d(depth)/du and d(depth)/dv, for BLEND_MEDIAN
EWA_UINT(PROJECT_MARKS, 8u);    // reads the splats' marks
// project_rays.comp
EWA_UINT(PROJECT_RAYS_DEEP, 1u);     // a splat counts to MARCH_DEPTH_MIN, not to the cut-off
EWA_UINT(PROJECT_RAYS_BY_MEAN, 2u);  // the key is the depth of the mean
// emit_instances.comp
EWA_UINT(EMIT_FIRST_INSTANCES, 1u);  // also writes where each splat's instances begin
EWA_UINT(EMIT_LISTS, 2u);            // in the order of the splats; also counts each list's instances
// sort_lists.comp: what it writes for place k of the sorted lists
EWA_UINT(LISTS_SPLATS, 0u);   // the splat
EWA_UINT(LISTS_TRACKED, 1u);  // the splat; and for an instance its place
EWA_UINT(LISTS_EMITTED, 2u);  // the instance's number
// scan_blocks.comp
EWA_UINT(SCAN_GATHERED, 1u);  // entry e is source[order[e]]
EWA_UINT(SCAN_FLAGS, 2u);     // entry e is 1 where source[e] is not 0
EWA_UINT(SCAN_LIVE, 3u);      // a block has Counts.sort_blocks entries; the others are not read
// blend.comp
EWA_UINT(BLEND_COLOR, 0u);
EWA_UINT(BLEND_DEPTH, 1u);       // also writes PLANE_DEPTH
EWA_UINT(BLEND_COUNT, 2u);       // also writes PLANE_COUNT
EWA_UINT(BLEND_ELLIPSOIDS, 3u);  // draws the nearest splat as a solid instead of blending
EWA_UINT(BLEND_MEDIAN, 4u);      // writes PLANE_MEDIAN and PLANE_T alone, of records with PROJECT_SLOPES
// pack.comp: what a pixel becomes
EWA_UINT(PACK_OPAQUE, 0u);  // a word: 8-bit RGB and an alpha of 255
EWA_UINT(PACK_BYTES, 1u);   // a word: 8-bit RGB and alpha
EWA_UINT(PACK_FLOATS, 2u);  // four words: floats of RGB and alpha
EWA_UINT(PACK_DEPTH, 3u);   // a word: a float, the mean depth
// radix_scatter.comp, bits
EWA_UINT(SORT_OWN_INDICES, 1u);  // the values are the items' own indices
EWA_UINT(SORT_DROP_KEYS, 2u);    // last pass: the sorted keys are not needed
// Each item's own index is moved with its value. The last pass writes each item's sorted index instead:
// indices_out[index] = sorted index.
EWA_UINT(SORT_TRACKED, 4u);
EWA_UINT(SORT_FIRST, 8u);  // with SORT_TRACKED, first pass: the indices are not stored yet
EWA_UINT(SORT_LAST, 16u);  // with SORT_TRACKED, last pass
EWA_UINT(SORT_FEW,
         32u);  // ranked, few blocks: each adds up the counters, which are counters[block * DIGITS + digit]
// blend_backward.comp, bits
EWA_UINT(BLEND_BACKWARD_ABSOLUTE, 1u);  // also sums absolute gradients by the mean
EWA_UINT(BLEND_BACKWARD_ALPHA, 2u);     // dL/d(image) also has dL/dT, in PLANE_T
EWA_UINT(BLEND_BACKWARD_FOURTH, 4u);    // a fourth channel, which takes the place of the depth
// collect_records.comp, bits
EWA_UINT(COLLECT_FEATURES, 1u);  // writes the features alone, of records that are there
EWA_UINT(COLLECT_RADII, 2u);     // a splat with a radius of 0 is skipped
EWA_UINT(COLLECT_LISTED, 4u);    // the tiles' lists are given: no depth keys and no tile counts
EWA_UINT(SHAPE_WHITENERS,
         8u);  // shapes are ux, k, vy; else conics. Also of gather_slots.comp, and of project_views
// gather_slots.comp, bits
EWA_UINT(GATHER_ADD, 1u);       // adds to the gradients that are there
EWA_UINT(GATHER_ABSOLUTE, 2u);  // the slots have absolute gradients
EWA_UINT(GATHER_FOURTH, 4u);    // the slots have a fourth channel
// loss_backward_rows.comp, bits
EWA_UINT(LOSS_SSIM, 1u);     // SSIM is a term of the loss
EWA_UINT(LOSS_SQUARES, 2u);  // so are squared differences
// sum_slots.comp: 0 or UPDATE_ABSOLUTE
// update.comp, and update_views.comp without UPDATE_GRADIENT_ONLY and UPDATE_MOTION: bits
EWA_UINT(UPDATE_GRADIENT_ONLY, 1u);  // writes the gradient into moments1 and moves nothing
// Adds to the densification statistics: norm of dL/d(mean) in normalised device coordinates, number of views
// that the splat is visible in.
EWA_UINT(UPDATE_STATISTICS, 2u);
// Adds the gradient of the regularisers, opacity_weight * opacity + scale_weight * (sum of the scales).
EWA_UINT(UPDATE_REGULARISED, 4u);
// The norm is that of the pixels' absolute gradients (Ye et al. 2024, AbsGS, eq. 7), which do not cancel.
EWA_UINT(UPDATE_ABSOLUTE, 8u);
EWA_UINT(UPDATE_PACKED_MOMENTS, 16u);  // moments1 holds both moments in 16 bits each
EWA_UINT(UPDATE_MOTION, 32u);          // also writes sums of the gradient by the camera's motion
EWA_UINT(UPDATE_BANDS, 64u);  // of update_views.comp alone: a view has several lists, one of each band
EWA_UINT(UPDATE_DEPTH,
         128u);  // of update.comp alone: the slots have the gradient by the depth as a fourth channel
// project_views.comp, project_views_backward.comp, bits; SHAPE_WHITENERS too
EWA_UINT(VIEWS_COVARIANCES, 1u);  // shapes are covariances, not quaternions and scales
EWA_UINT(VIEWS_OPACITIES, 2u);    // the radii depend on the opacities
EWA_UINT(VIEWS_GRADIENTS, 4u);    // also the gradient of the view matrices
// harmonics.comp, harmonics_backward.comp, bits
EWA_UINT(HARMONICS_MASKED, 1u);      // a (view, splat) pair whose mask is 0 has the colour 0
EWA_UINT(HARMONICS_DIRECTIONS, 2u);  // also the gradient of the directions
EWA_UINT(HARMONICS_RGB, 4u);         // there are 3 channels: loads of a vec3 are faster than of floats
// densify_write.comp, mcmc_write.comp: the array of the next generation that is written
EWA_UINT(WRITE_PARAMS, 0u);
EWA_UINT(WRITE_MOMENTS, 1u);  // one of the two in float32, or both in one

// ---- SPEC_BROADCAST ----
EWA_UINT(BROADCAST_SHUFFLES, 0u);  // one splat a lane, in registers
EWA_UINT(BROADCAST_SHARED, 1u);    // in shared memory
EWA_UINT(BROADCAST_UNIFORM, 2u);   // every lane loads every splat: free where uniform loads are scalar

// ---- SPEC_SLOTS ----
EWA_UINT(SLOTS_SORTED, 0u);  // as the tiles' lists; indices[i]: where emitted instance i is in the lists
EWA_UINT(SLOTS_EMITTED,
         1u);  // as the instances were emitted; indices[k]: which of them entry k of the lists is

// ---- Where a grand total or a sum is written ----
// ScanTotalsPush.total
EWA_UINT(TOTAL_NONE, 0u);
EWA_UINT(TOTAL_INSTANCES, 1u);  // Counts.instances
EWA_UINT(TOTAL_SCAN, 2u);       // Counts.scan_total
// ReducePush.target: of all rows REDUCE_TO_SUMS, or of the first row one of the others. Further rows have those that follow.
EWA_UINT(REDUCE_TO_SUMS, 0u);     // sums[block]
EWA_UINT(REDUCE_TO_SSIM, 1u);     // Counts.ssim
EWA_UINT(REDUCE_TO_L1, 2u);       // Counts.l1
EWA_UINT(REDUCE_TO_SQUARED, 3u);  // Counts.squared
EWA_UINT(REDUCE_TO_L2, 4u);       // Counts.l2
EWA_UINT(REDUCE_TO_ALPHA, 5u);    // Counts.alpha
EWA_UINT(REDUCE_TO_DEPTH, 6u);    // Counts.depth

// ---- Loss: what one invocation owns ----
// A pass down the columns: one texel (4 pixels) of LOSS_ROWS rows. A pass along the rows: LOSS_TEXELS texels
// of one row. Neighbouring outputs share most of their window.
EWA_UINT(LOSS_ROWS, 4u);
EWA_UINT(LOSS_TEXELS, 4u);
// ---- Loss planes per colour channel c ----
EWA_UINT(MOMENT_PLANES, 4u);      // of 4 c + 0: mean x; 1: mean y; 2: mean x^2 + y^2; 3: mean x y
EWA_UINT(DERIVATIVE_PLANES, 3u);  // of 3 c + 0: dS/d(mean x); 1: dS/d(mean x^2); 2: dS/d(mean x y)

// ---- PPISP: exposure and colours of a training image, vignette and response of a camera ----
// The buffer has PPISP_PHOTO_FLOATS for each photo: exposure in stops; latent offsets x y of blue, red, green, grey; 0 0 0.
// Then it has PPISP_CAMERA_FLOATS for each camera. PPISP_CHANNEL_FLOATS for each channel: the vignette's centre x y and
// factors of r^2 r^4 r^6; toe, shoulder, gamma and middle of the response, before lib/ppisp.glsl maps them to their ranges.
// Then the number of steps that the camera has taken. The means of the photos' values at the end of a step come last.
EWA_UINT(PPISP_PHOTO_FLOATS, 12u);
EWA_UINT(PPISP_PHOTO_VALUES, 9u);
EWA_UINT(PPISP_CHANNEL_FLOATS, 9u);
EWA_UINT(PPISP_CAMERA_VALUES, 27u);
EWA_UINT(PPISP_CAMERA_FLOATS, 28u);
// What a pass sums over pixels: dL/d(exposure), dL/d(colour map) by columns, dL/d(camera's values, of the response after
// their mapping).
EWA_UINT(PPISP_SUM_FLOATS, 37u);
EWA_UINT(PPISP_BLOCK, 4096u);  // pixels whose gradient one subgroup sums

// ---- A bilateral grid: cell (x, y, z) at x + GRID_WIDTH (y + GRID_HEIGHT z), 3 texels of (row of the matrix, offset) ----
// A grid of one cell is an affine map of colours, the same at all pixels.
EWA_UINT(GRID_ONE_CELL, 1u);  // bit of SPEC_MODE
EWA_UINT(GRID_CELL_FLOATS, 12u);
EWA_UINT(GRID_CELLS, 2048u);
EWA_UINT(GRID_FLOATS, 24576u);      // of a photo
EWA_UINT(GRID_LEVELS, 4u);          // levels of grey that a subgroup sums at once
EWA_UINT(GRID_PART_PIXELS, 8192u);  // pixels of a column of cells that a subgroup sums, or a row of them more

// ---- A camera's motion: what training learns of a camera ----
// 2 texels at 2 * image: rotation vector (radians, camera axes), logarithm of the factor of the focal lengths; shift of
// the centre (world units, along the axes that the camera had at the start), 0. lib/motion.glsl has the formulas. Those of the
// images' readouts, if any, follow those of the images.
EWA_UINT(MOTION_TEXELS, 2u);
EWA_UINT(MOTION_FLOATS, 8u);
EWA_UINT(MOTION_VALUES, 7u);  // without the last float
EWA_UINT(READOUT_MOTION_VALUES,
         14u);  // rows of sums with LENSES_ROLLING: those of the pose, then those of the readout
// A camera's basis: MOTION_VALUES rows of as many floats. The motion changes by the basis times a step of Adam.
EWA_UINT(MOTION_BASIS_FLOATS, 49u);

// A radix sort that ranks in shared memory: a workgroup has RANKED_SUBGROUPS subgroups, and an invocation
// RANKED_LANE_KEYS keys, or half of that with more than 32 lanes a subgroup.
EWA_UINT(RANKED_SUBGROUPS, 8u);
EWA_UINT(RANKED_LANE_KEYS, 16u);

// ---- Lenses, with SPEC_LENSES ----
EWA_UINT(LENSES_PINHOLE, 0u);
EWA_UINT(LENSES_ANY, 1u);      // some camera is not a pinhole
EWA_UINT(LENSES_ROLLING, 2u);  // some camera moves during its readout; lib/readout.glsl has the formulas
EWA_UINT(LENS_BROWN, 0u);      // of tangents; a pinhole has no terms
EWA_UINT(LENS_FISHEYE, 1u);
EWA_UINT(LENS_EQUIRECTANGULAR, 2u);
EWA_UINT(LENS_ORTHOGRAPHIC, 3u);
// Indices of the terms.
EWA_UINT(LENS_K1, 0u);
EWA_UINT(LENS_K2, 1u);
EWA_UINT(LENS_P1, 2u);
EWA_UINT(LENS_P2, 3u);
EWA_UINT(LENS_K3, 4u);
EWA_UINT(LENS_K4, 5u);
EWA_UINT(LENS_K5, 6u);
EWA_UINT(LENS_K6, 7u);
EWA_UINT(LENS_S1, 8u);
EWA_UINT(LENS_S2, 9u);
EWA_UINT(LENS_S3, 10u);
EWA_UINT(LENS_S4, 11u);

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
    float lens_hi[12];  // LENS_K1 ...: the terms of the lens
    float lens_lo[12];
    float lens_limit;  // LENS_BROWN: largest x^2 + y^2 of tangents; LENS_FISHEYE: largest angle (radians)
    uint lens;         // LENS_*
    // With LENSES_ROLLING: scene::middle_motion. The pose above is that of the middle of the readout. Zeros with a global shutter.
    float readout_turn[3];   // radians
    float readout_shift[3];  // world units
    float readout_slope
        [2];  // d(time)/d(pixel); the time is -0.5 at the border where the readout begins, and 0.5 at the other
    float readout_first;  // time of the pixel (0, 0)
};

// A view of the operators, whose matrix need not be a rotation. The values are as the caller gave them.
struct ViewBlock {
    float rotation[9];  // world to camera, rows
    float translation[3];
    float focal_hi[2];  // px
    float center[2];    // principal point, px
    float tan_min[2];   // bounds of x/z, y/z in the Jacobian
    float tan_max[2];
    float lens_hi[12];  // as in CameraBlock, where SPEC_LENSES is set
    float lens_lo[12];
    float lens_limit;
    uint lens;
};

// dL/d(view matrix): rotation, rows; translation
EWA_UINT(VIEW_GRADIENT_FLOATS, 12u);

// Written by the device, read back by the host after a submission.
struct Counts {
    uint instances;          // (splat, tile) pairs that the frame needs; may exceed the capacity
    uint skipped_nonfinite;  // splats skipped: a value is not finite, or the quaternion is zero
    uint dropped_updates;    // parameter updates that were not finite
    uint scan_total;         // grand total of a scan with TOTAL_SCAN
    float l1;                // mean |x - y|
    float ssim;              // mean SSIM
    float squared;           // mean (x - y)^2, both clamped to [0, 1]
    uint limited_steps;      // steps of a mean, quaternion or scale that were shortened
    uint visible;            // splats that reach a tile; counted with PROJECT_DEBUG
    uint unfinished;         // strips of tiles with more splats than rays can walk
    float l2;                // mean (x - y)^2, with LOSS_SQUARES
    float alpha;             // mean |1 - T - alpha of the training image|
    float depth;             // mean |ln(depth / depth of the training image)|
    // With live counts: the blocks of keys of the sort of the instances, and as many workgroups along x, y and z, which an
    // indirect dispatch reads. None if the instances exceed the capacity.
    uint sort_blocks;
    uint sort_groups[3];
    // Not cleared by a frame that may begin before the host has read the counts of the one before. Once a frame
    // has too many instances, this is 1, later frames report 2^32 - 1 instances, and no pass changes the model.
    uint overflowed;
};

struct ProjectPush {
    uint splats;
    uint planes;            // texel planes a splat
    float log_scale_shift;  // with PROJECT_DEBUG: added to every log scale
    uint hidden_marks;      // with PROJECT_MARKS: bits of marks whose splats are not drawn
    uint tinted_marks;      // with PROJECT_MARKS: MARK_* bits that change the colour
};

struct ViewsPush {
    uint splats;
    uint views;
    float size[2];      // px
    float near, far;    // visible where near < z < far (world units)
    float low_pass;     // px^2
    float radius_clip;  // px
};

struct HarmonicsPush {
    uint splats;
    uint views;
    uint coefficients;  // stored, of each channel
    uint channels;
};

struct SortPush {
    uint items;  // number of items; 0: Counts.instances, or none if that exceeds `capacity`
    uint capacity;
    uint lanes;  // lanes, or workgroups that rank in shared memory, which share the items
    uint shift;  // first bit of the digit
};

struct ScanPush {
    uint items;  // all entries
    uint block;  // entries a subgroup scans
};

struct ScanTotalsPush {
    uint blocks;
    uint total;     // TOTAL_*: where the grand total is written
    uint capacity;  // with TOTAL_INSTANCES: of instances
    // With TOTAL_INSTANCES: keys of a workgroup of the sort, or 0 without live counts; and the most workgroups along x.
    uint sort_keys, max_groups;
};

struct EmitPush {
    uint splats;
    uint capacity;  // of instances
    uint scan_block;
    uint strip_rows;  // tile rows one lane walks
    uint size[2];     // px
    uint tiles[2];
};

struct TileStartsPush {
    uint tiles;
    uint capacity;
};

struct ListPush {
    uint tiles;
    uint capacity;  // of instances
};

struct BlendPush {
    float background[3];
    ImageLayout image;
    uint tiles[2];
    uint tile_step[2];  // tile = workgroup.x * step.x + workgroup.y * step.y
    uint capacity;      // of instances
};

struct RayPush {
    BlendPush blend;
    uint samples;  // intervals of a marching ray
    uint strip;    // of a gradient: the tiles' strips are done one after another
};

struct CollectPush {
    uint splats;
    uint channels;       // of the features
    uint first_channel;  // of the record; it holds 4
    uint size[2];        // px
};

struct GatherPush {
    uint splats;
    uint channels;
    uint first_channel;
};

struct UnpackPush {
    float background[3];
    ImageLayout image;
    uint first_pixel;  // of the photo: the image's first
};

struct MaskPush {
    ImageLayout image;
    uint first_pixel;  // of the photo: the image's first
};

struct PackPush {
    uint plane_floats;
};

struct PpispPush {
    ImageLayout image;
    uint photo, camera;  // where their values begin, in floats
};

struct PpispUpdatePush {
    uint photo, camera, means;  // where their values begin, in floats
    uint blocks;                // of partial sums
    uint slot;                  // of the view's gradient of the camera's values, in the step
    float rate;
    float bias1, bias2;  // 1 / (1 - beta^visit); each training image has its own number of steps
    uint instance_capacity;
};

struct PpispCameraPush {
    uint camera, means;  // where their values begin, in floats
    uint photos;
    uint views;  // of the step, of this camera and of others
    float rate;
    uint instance_capacity;
};

struct GridPush {
    ImageLayout image;
    uint photo;            // index of the training image
    uint parts;            // into which the rows of pixels of a column of cells are divided
    uint columns, stacks;  // of cells; of GRID_LEVELS of a column
};

struct GridUpdatePush {
    uint texels;  // of a grid
    uint photo;
    uint parts;
    float rate;
    float pull;  // d(loss)/d(value) for a value 1 away from the identity's
    float bias1, bias2;
    uint instance_capacity;
};

struct SkyPush {
    ImageLayout image;
    uint size;       // texels a side of the map
    uint first_row;  // of the view: the image's first
};

struct SkyGradientPush {
    SkyPush sky;
    uint slot;  // of the view in the step: its first float
};

struct SkyUpdatePush {
    uint size;   // texels a side of the map
    uint views;  // of the step
    float rate;
    float bias1, bias2;  // 1 / (1 - beta^step)
    uint instance_capacity;
};

struct MoveCameraPush {
    uint motion;   // index of the training image's motion
    uint readout;  // of what is learned of its readout; that of the motion: nothing
};

struct MotionUpdatePush {
    uint motion;
    uint first_row;  // of its sums. Above 0: of a readout, whose sums are the gradient by the values
    uint blocks;     // of partial sums
    float rate;
    float pull, shift_pull;  // d(loss)/d(value) for a value of 1
    float beta1, beta2;      // Adam's
    float bias1, bias2;      // 1 / (1 - beta^visit); each training image has its own number of steps
    uint instance_capacity;
};

struct LossPush {
    ImageLayout image;
    float ssim_scale;  // d(loss)/d(SSIM of one pixel and channel)
    float l1_scale;    // d(loss)/d|x - y| of one pixel and channel
    float l2_scale;    // d(loss)/d((x - y)^2) of one pixel and channel
    uint own[2];       // first and one-past-last of the rows that the loss counts
};

struct AlphaPush {
    ImageLayout image;
    uint first_pixel;  // of the photo: the image's first
    uint own[2];       // first and one-past-last of the rows that the loss counts
    float scale;       // d(loss)/d|difference of the alphas| of one pixel
};

struct DepthPush {
    ImageLayout image;
    uint first_pixel;  // of the depth map: the image's first
    uint own[2];       // first and one-past-last of the rows that the loss counts
    float scale;       // d(loss)/d|difference of the logarithms| of one pixel
};

struct ReducePush {
    uint items;   // of each row
    uint block;   // items a subgroup adds up
    uint target;  // REDUCE_*
    uint rows;    // added up separately
    float scale;  // applied to the result
};

// Values of a pass whose command is replayed in every step: a uniform block in place of push constants. So is PerturbBlock.
struct UpdateBlock {
    uint splats;
    uint planes;  // texel planes a splat
    uint instance_capacity;
    float mean_rate, opacity_rate, quaternion_rate, scale_rate, sh0_rate, sh_rest_rate;
    // Shares of the first moment and of the gradient in a step (pipeline/adam.h), and 1 / (1 - beta2^step)
    float moment_share, gradient_share, bias2;
    float half_size[2];  // W / 2, H / 2: px to normalised device coordinates
    // With UPDATE_REGULARISED: d(loss)/d(opacity) and d(loss)/d(scale along one axis) of every splat.
    float opacity_weight, scale_weight;
    // With UPDATE_PACKED_MOMENTS: of the rounding.
    uint seed[2];
    uint step;
};

struct BandTilesPush {
    uint splats;
    uint first_row;  // of the view: the band's first
    uint size[2];    // px, of the band
};

struct CollectVisiblePush {
    uint splats;
    uint scan_block;
    uint list;          // number of the view's list, or of its band's
    uint first_index;   // of the list, in all lists one after another
    uint first_record;  // where the list's records begin
    uint first_row;     // of the view: the band's first
};

struct ReceivePush {
    uint splats;
    uint size[2];  // px
};

struct SumSlotsPush {
    uint splats;
    uint first_index;  // of the view's list, in the lists of all views one after another
};

// Has the members of UpdateBlock that lib/adam.glsl uses.
struct UpdateViewsPush {
    uint splats;
    uint first;   // number of the first splat, among those of all ranks
    uint planes;  // texel planes a splat
    uint views;
    uint bands;   // lists of a view, with UPDATE_BANDS
    float share;  // of a view in the gradient: 1 / views
    float mean_rate, opacity_rate, quaternion_rate, scale_rate, sh0_rate, sh_rest_rate;
    float beta1, beta2, epsilon;  // Adam's
    // Shares of the first moment and of the gradient in a step (pipeline/adam.h), and 1 / (1 - beta2^step)
    float moment_share, gradient_share, bias2;
    // With UPDATE_REGULARISED: d(loss)/d(opacity) and d(loss)/d(scale along one axis) of every splat.
    float opacity_weight, scale_weight;
    // With UPDATE_PACKED_MOMENTS: of the rounding.
    uint seed[2];
    uint step;
};

struct DensifyPush {
    uint splats;        // of the old buffers
    uint planes;        // texel planes a splat
    uint new_capacity;  // splats that the new buffers hold
    uint scan_block;
    float grow_gradient;  // threshold of the mean gradient norm
    float split_scale;    // world units; a larger splat is split, another is cloned
    float prune_opacity;  // logit
    float prune_scale;    // world units; a larger splat is pruned; 0: none is
    uint seed[2];
    uint step;
    uint first;  // number of the first splat, among those of all ranks
    uint split;  // SPLIT_*
    // Low corner, then high corner: a splat whose mean is outside is neither cloned nor split.
    float region[6];
    // Middle and radius of the cameras' ball: a splat that is larger than its distance to the ball is pruned.
    float ball[4];
    uint frozen;  // 1: some splats are frozen, and the moments say which; else 0
};

struct ResetPush {
    uint splats;
    uint planes;  // texel planes a splat
    float logit;
};

struct McmcPush {
    uint splats;      // of the old buffers
    uint planes;      // texel planes a splat
    uint new_splats;  // of the new buffers
    uint scan_block;
    uint dead;            // splats to relocate
    uint draws;           // sources to draw, for all ranks
    uint total;           // sum of the weights of all ranks
    uint total_before;    // of the ranks before this one
    uint own_total;       // of this rank
    float weight_scale;   // weight of an opacity of 1
    float dead_logit;     // a splat at or below it is dead
    float least_opacity;  // lower bound of the opacity that a source and its copies share
    float spread;         // standard deviations of the source by which it and its copies move apart
    float region[6];      // low corner, then high corner: a splat whose mean is outside is no source
    uint seed[2];
    uint step;
    uint first;   // number of the first splat, among those of all ranks
    uint frozen;  // as in DensifyPush
};

struct PerturbBlock {
    uint splats;
    uint planes;  // texel planes a splat
    uint instance_capacity;
    float amplitude;
    float max_length;  // of the noise along an axis of the splat (world units)
    uint seed[2];
    uint step;
    uint first;   // number of the first splat, among those of all ranks
    uint frozen;  // as in DensifyPush
};

// ---- A mesh scene for ray tracing: buffers of rgba32ui texels that hold floats by their bits ----
// Positions are relative to an origin, which the host subtracts in float64.
// Node: for each of two children low x y z, reference; high x y z, 0. A reference is the index of a
// node, or of a leaf: LEAF_FLAG, triangles - 1 at LEAF_COUNT_SHIFT, and the first triangle. A missing
// child has low above high.
EWA_UINT(NODE_TEXELS, 4u);
EWA_UINT(LEAF_FLAG, 0x80000000u);
EWA_UINT(LEAF_COUNT_SHIFT, 28u);
EWA_UINT(LEAF_FIRST_MASK, 0x0fffffffu);
// Triangle: corner 0 x y z, material; corner 1 - corner 0, 0; corner 2 - corner 0, 1 if cameras see its back.
EWA_UINT(TRIANGLE_TEXELS, 3u);
// Surface: three normals (octahedral, 2 x snorm16), colour 0; uv 0, uv 1; uv 2, colour 1, colour 2. Colours
// are RGBA, 4 x unorm8.
EWA_UINT(SURFACE_TEXELS, 3u);
// Material: base r g b, opacity; metallic, roughness, F0 and F90 of the dielectric; emitted r g b, cut-off or
// 0; textures of base, metal and roughness, emission (NO_TEXTURE: none), MATERIAL_* flags; density of light
// sampling per area of its triangles, 0 0 0.
EWA_UINT(MATERIAL_TEXELS, 5u);
EWA_UINT(NO_TEXTURE, 0xffffffffu);
EWA_UINT(MATERIAL_TWO_SIDED, 1u);  // emits on both sides, and cameras see its back
EWA_UINT(MATERIAL_MASKED, 2u);     // exists only where its opacity reaches the cut-off
EWA_UINT(MATERIAL_BLENDED, 4u);    // stops a ray with the probability of its opacity
EWA_UINT(MATERIAL_UNLIT, 8u);      // emits its base colour, vertex colours included
// Texture: first texel, width, height, TEXTURE_* flags.
EWA_UINT(WRAP_REPEAT, 0u);
EWA_UINT(WRAP_CLAMP, 1u);
EWA_UINT(WRAP_MIRROR, 2u);
EWA_UINT(TEXTURE_WRAP_T_SHIFT, 2u);
EWA_UINT(TEXTURE_NEAREST, 16u);
// Light: position (directional: direction to it; triangle: 0), LIGHT_* kind; r g b, probability; spot's
// direction, range or 0 (triangle: its index); spot's scale and offset, alias threshold, alias.
EWA_UINT(LIGHT_TEXELS, 4u);
EWA_UINT(LIGHT_DIRECTIONAL, 0u);
EWA_UINT(LIGHT_POINT, 1u);
EWA_UINT(LIGHT_SPOT, 2u);
EWA_UINT(LIGHT_TRIANGLE, 3u);

// A ray through a lens, in the scene as packed: origin, direction of unit length; zeros where the lens shows nothing.
EWA_UINT(PIXEL_RAY_FLOATS, 6u);

struct TraceView {
    float rotation[9];                       // world to camera, rows
    float position[3];                       // relative to the origin of the triangles
    float focal[2];                          // px
    float center[2];                         // px
    uint size[2];                            // px
    float zenith[3], horizon[3], ground[3];  // radiance of the sky straight up, level and straight down
    float sample_max;                        // radiance
};

// Integer sums: their order does not matter.
struct TraceCounts {
    uint unfinished_rays;  // ended by the step limit
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
