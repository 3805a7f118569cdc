// SPDX-License-Identifier: Apache-2.0
// All passes. pass.h explains the members.
#pragma once
#include "passes/pass.h"

namespace ewa::passes {

// Projection, and its gradient with the optimiser's step.

/// The buffers of the projections. They add to Counts.skipped_nonfinite.
struct ProjectBuffers {
    using Work = PerElement<&shared::ProjectPush::splats>;
    gpu::BufferPart params, camera, records, depth_keys, tile_counts, counts;
};

/// Projects every splat into pixels. marks: a byte a splat. Variant: SPEC_SH_DEGREE, SPEC_KERNEL, SPEC_MODE (PROJECT_* bits),
/// SPEC_LENSES, SPEC_WRAP, SPEC_QUADS.
struct Project : ProjectBuffers {
    static constexpr char shader[] = "project";
    gpu::BufferPart marks;
};

/// Prepares splats for rays. rays: how a ray meets each. Variant: SPEC_SH_DEGREE, SPEC_KERNEL, SPEC_MODE (0,
/// PROJECT_RAYS_DEEP or PROJECT_RAYS_BY_MEAN), SPEC_LENSES, SPEC_WRAP.
struct ProjectRays : ProjectBuffers {
    static constexpr char shader[] = "project_rays";
    gpu::BufferPart rays;
};

/// The buffers of a projection's gradient, fused with Adam. values: an UpdateBlock.
struct UpdateBuffers {
    using Work = PerElementOfBlock<&shared::UpdateBlock::splats>;
    gpu::BufferPart params, camera, records, slots, moments1, moments2, tile_counts, first_instances, counts,
        params_out, moments1_out, moments2_out, statistics, sorted_indices, values;
};

/// Gradient of Project. Variant: SPEC_SH_DEGREE, SPEC_KERNEL, SPEC_MODE (UPDATE_* bits), SPEC_LENSES, SPEC_SLOTS.
struct Update : UpdateBuffers {
    static constexpr char shader[] = "update";
    gpu::BufferPart motion_sums;
};

/// Gradient of ProjectRays. Variant: SPEC_SH_DEGREE, SPEC_KERNEL, SPEC_MODE (UPDATE_* bits), SPEC_LENSES.
struct UpdateRays : UpdateBuffers {
    static constexpr char shader[] = "update_rays";
};

// A batch of views. Each view has a list of the splats that reach a tile of it.

/// Counts the tiles of a view's band that each splat reaches, after Project. Variant: SPEC_WRAP, SPEC_QUADS.
struct BandTiles {
    static constexpr char shader[] = "band_tiles";
    using Work = PerElement<&shared::BandTilesPush::splats>;
    gpu::BufferPart records, depth_keys, tile_counts;
};

/// Lists the visible splats of a view, or of its band: writes each splat's list index and copies the listed records.
struct CollectVisible {
    static constexpr char shader[] = "collect_visible";
    using Work = PerElement<&shared::CollectVisiblePush::splats>;
    gpu::BufferPart records, tile_counts, prefix, totals, list_indices, visible;
};

/// Depth keys and tile counts of a list of records. Variant: SPEC_WRAP, SPEC_QUADS.
struct ReceiveRecords {
    static constexpr char shader[] = "receive_records";
    using Work = PerElement<&shared::ReceivePush::splats>;
    gpu::BufferPart records, depth_keys, tile_counts;
};

/// Adds the gradient slots of each listed splat. Variant: SPEC_MODE (0 or UPDATE_ABSOLUTE), SPEC_SLOTS.
struct SumSlots {
    static constexpr char shader[] = "sum_slots";
    using Work = PerElement<&shared::SumSlotsPush::splats>;
    gpu::BufferPart records, slots, tile_counts, first_instances, sorted_indices, sums;
};

/// Gradient of the projection in all views, fused with Adam. Variant: SPEC_SH_DEGREE, SPEC_KERNEL, SPEC_MODE (UPDATE_*
/// bits without UPDATE_GRADIENT_ONLY and UPDATE_MOTION), SPEC_LENSES.
struct UpdateViews {
    static constexpr char shader[] = "update_views";
    using Work = PerElement<&shared::UpdateViewsPush::splats>;
    gpu::BufferPart params, cameras, list_indices, sums, moments1, moments2, counts, params_out, moments1_out,
        moments2_out, statistics;
};

// The motion of a training camera: the learned correction of its pose and focal length.

/// Writes the camera that a frame uses: the dataset's camera with its motion applied.
struct MoveCamera {
    static constexpr char shader[] = "move_camera";
    using Work = OneSubgroup<shared::MoveCameraPush>;
    gpu::BufferPart camera, motions, moved;
};

/// Adam's step of one training camera's motion.
struct MotionUpdate {
    static constexpr char shader[] = "motion_update";
    using Work = OneSubgroup<shared::MotionUpdatePush>;
    gpu::BufferPart sums, motions, moments1, moments2, bases, counts;
};

/// Projects every splat as a sphere. marks: a byte a splat. Variant: SPEC_SH_DEGREE, SPEC_MODE (PROJECT_DEBUG,
/// PROJECT_MARKS).
struct ProjectPoints : ProjectBuffers {
    static constexpr char shader[] = "project_points";
    gpu::BufferPart marks;
};

/// Gradient of ProjectPoints, fused with Adam. Variant: SPEC_SH_DEGREE, SPEC_MODE (UPDATE_* bits without
/// UPDATE_REGULARISED).
struct UpdatePoints : UpdateBuffers {
    static constexpr char shader[] = "update_points";
};

// The operators of projection and of spherical harmonics. Their arrays are the caller's: include/ewa/operators.h.

/// Projects splats in several views. shapes: quaternions, or covariances with VIEWS_COVARIANCES. Variant: SPEC_KERNEL
/// (KERNEL_ANTIALIAS writes compensations), SPEC_MODE (VIEWS_COVARIANCES, VIEWS_OPACITIES, SHAPE_WHITENERS),
/// SPEC_LENSES.
struct ProjectViews {
    static constexpr char shader[] = "project_views";
    using Work = PerViewElement<shared::ViewsPush>;
    gpu::BufferPart views, means, shapes, scales, opacities, radii, means2d, depths, conics, compensations;
};

/// Gradient of ProjectViews, added over the views. view_sums: VIEW_GRADIENT_FLOATS rows a view, of one float a subgroup.
/// Variant: SPEC_KERNEL, SPEC_MODE (VIEWS_COVARIANCES, VIEWS_GRADIENTS, SHAPE_WHITENERS), SPEC_LENSES.
struct ProjectViewsBackward {
    static constexpr char shader[] = "project_views_backward";
    using Work = PerElement<&shared::ViewsPush::splats>;
    gpu::BufferPart views, means, shapes, scales, radii, means2d_gradient, depths_gradient, conics_gradient,
        compensations_gradient, means_gradient, shapes_gradient, scales_gradient, view_sums;
};

/// Evaluates spherical harmonics. masks: a byte a (view, splat) pair. rgb_coefficients: the same as coefficients. Variant:
/// SPEC_SH_DEGREE (0 to 4), SPEC_MODE (HARMONICS_MASKED, HARMONICS_RGB).
struct Harmonics {
    static constexpr char shader[] = "harmonics";
    using Work = PerElement<&shared::HarmonicsPush::splats>;
    gpu::BufferPart directions, coefficients, masks, colors, rgb_coefficients;
};

/// Gradient of Harmonics, that of the coefficients added over the views. Variant: SPEC_SH_DEGREE (0 to 4), SPEC_MODE
/// (HARMONICS_* bits).
struct HarmonicsBackward {
    static constexpr char shader[] = "harmonics_backward";
    using Work = PerElement<&shared::HarmonicsPush::splats>;
    gpu::BufferPart directions, coefficients, masks, colors_gradient, coefficients_gradient,
        directions_gradient, rgb_coefficients;
};

// Prefix sums, radix sort, and the lists of (splat, tile) instances built with them.

/// Exclusive prefix sums within blocks. Variant: SPEC_MODE (0, SCAN_GATHERED, SCAN_FLAGS or SCAN_LIVE).
struct ScanBlocks {
    static constexpr char shader[] = "scan_blocks";
    using Work = PerBlock<shared::ScanPush>;
    gpu::BufferPart source, order, prefix, totals, counts;
};

/// Exclusive prefix sum of the blocks' totals, in place, followed by the grand total.
struct ScanTotals {
    static constexpr char shader[] = "scan_totals";
    using Work = OneSubgroup<shared::ScanTotalsPush>;
    gpu::BufferPart totals, counts;
};

/// Counts the digits of a radix pass. Variant: SPEC_RADIX_BITS.
struct RadixCount {
    static constexpr char shader[] = "radix_count";
    using Work = PerSortLane;
    gpu::BufferPart keys, counters, counts;
};

/// The buffers of moving the pairs in a radix pass.
struct ScatterBuffers {
    gpu::BufferPart keys, values, counters, bases, counts, keys_out, values_out, indices, indices_out;
};

/// Moves the pairs of a radix pass. Variant: SPEC_RADIX_BITS, SPEC_MODE (SORT_* bits).
struct RadixScatter : ScatterBuffers {
    static constexpr char shader[] = "radix_scatter";
    using Work = PerSortLane;
};

/// RadixCount with the counting in shared memory. Variant: SPEC_RADIX_BITS, SPEC_MODE (0 or SORT_FEW).
struct RadixCountRanked {
    static constexpr char shader[] = "radix_count_ranked";
    using Work = PerRankedBlock;
    gpu::BufferPart keys, counters, counts;
};

/// RadixScatter with the ranking in shared memory. Variant: SPEC_RADIX_BITS, SPEC_MODE (SORT_* bits).
struct RadixScatterRanked : ScatterBuffers {
    static constexpr char shader[] = "radix_scatter_ranked";
    using Work = PerRankedBlock;
};

/// Writes the (splat, tile) instances in depth order, each layer for a strip of tile rows. Variant: SPEC_MODE
/// (0 or EMIT_FIRST_INSTANCES), SPEC_WRAP, SPEC_QUADS.
struct EmitInstances {
    static constexpr char shader[] = "emit_instances";
    struct Work : ElementGroup<shared::EmitPush> {
        static Groups groups(const KernelConfig& config, const Push& push) {
            return dealt_groups(config, push.splats, (push.tiles[1] + push.strip_rows - 1) / push.strip_rows);
        }
    };
    gpu::BufferPart records, order, tile_counts, prefix, totals, counts, keys, splats, first_instances, lists;
};

/// Where each tile's list begins: in place of how many instances it has, and in tile_starts. One workgroup.
struct ScanLists {
    static constexpr char shader[] = "scan_lists";
    struct Work : ElementGroup<shared::ListPush> {
        static Groups groups(const KernelConfig&, const Push&) { return {1, 1, 1}; }
    };
    gpu::BufferPart lists, tile_starts;
};

/// Puts instances into the lists of their tiles, with the depth keys of their splats.
struct FillLists {
    static constexpr char shader[] = "fill_lists";
    using Work = PerElement<&shared::ListPush::capacity>;
    gpu::BufferPart tiles, splats, depth_keys, counts, lists, keys, instances;
};

/// Sorts each tile's list by depth. A workgroup for each. Variant: SPEC_MODE (LISTS_*).
struct SortLists {
    static constexpr char shader[] = "sort_lists";
    struct Work {
        using Push = shared::ListPush;
        static uint32_t group_size(const KernelConfig&) { return kListGroup; }
        static Groups groups(const KernelConfig& config, const Push& push) {
            return grid_of(config, uint64_t(push.tiles) + 1);
        }
    };
    gpu::BufferPart tile_starts, keys, instances, splats, places;
};

/// Finds where each tile's instances begin in the sorted list.
struct TileStarts {
    static constexpr char shader[] = "tile_starts";
    struct Work : ElementGroup<shared::TileStartsPush> {
        static Groups groups(const KernelConfig& config, const Push& push) {
            return element_groups(config, uint64_t(push.tiles) + 2);
        }
    };
    gpu::BufferPart keys, counts, tile_starts;
};

// Blending of splats into image planes, and its gradient.

/// The buffers of blending.
struct BlendBuffers {
    using Work = PerTile;
    gpu::BufferPart records, splats, tile_starts, planes;
};

/// The buffers of blending's gradients: planes, and the slot of every (splat, tile) instance.
struct BlendBackwardBuffers : BlendBuffers {
    gpu::BufferPart image_gradient, slots;
};

/// Blends the splats of every tile into the image planes. indices: with SLOTS_EMITTED. Variant: SPEC_MODE (BLEND_*), SPEC_WRAP,
/// SPEC_SLOTS.
struct Blend : BlendBuffers {
    static constexpr char shader[] = "blend";
    gpu::BufferPart indices;
};

/// Gradient of Blend. Variant: SPEC_MODE (BLEND_BACKWARD_* bits), SPEC_WRAP, SPEC_SLOTS.
struct BlendBackward : BlendBackwardBuffers {
    static constexpr char shader[] = "blend_backward";
    gpu::BufferPart indices;
};

/// Raises each splat's largest weight at a pixel: the bits of a float a splat. Variant: SPEC_KERNEL, SPEC_WRAP, SPEC_SLOTS.
struct Contribute {
    static constexpr char shader[] = "contribute";
    using Work = PerTile;
    gpu::BufferPart records, splats, tile_starts, largest, indices;
};

/// Absolute gradients by the means over any number of channels, in slots whose other floats are 0. Variant: SPEC_MODE (the
/// number of channels), SPEC_SHARP, SPEC_PARTS.
struct BlendAbsolute {
    static constexpr char shader[] = "blend_absolute";
    using Work = PerTile;
    gpu::BufferPart records, splats, tile_starts, features, pixels, slots;
};

/// Blends the nearest spheres of every pixel. Variant: SPEC_NEAREST, SPEC_MODE (BLEND_COLOR, BLEND_DEPTH or BLEND_COUNT).
struct BlendPoints : BlendBuffers {
    static constexpr char shader[] = "blend_points";
};

/// Gradient of BlendPoints, in slots as those of BlendBackward. Variant: SPEC_NEAREST, SPEC_MODE (0 or
/// BLEND_BACKWARD_ABSOLUTE).
struct BlendPointsBackward : BlendBackwardBuffers {
    static constexpr char shader[] = "blend_points_backward";
};

/// The buffers of the passes along rays. They add to Counts.unfinished.
struct AlongRays : BlendBuffers {
    using Work = PerStrip;
    gpu::BufferPart rays, camera, counts;
};

/// Blends the splats of every ray in their order along it. Variant: SPEC_KERNEL, SPEC_MODE (BLEND_COLOR, BLEND_DEPTH), SPEC_LENSES.
struct BlendRays : AlongRays {
    static constexpr char shader[] = "blend_rays";
};

/// Blends the splats of every ray in the order of the tile's list. Variant: as of BlendRays.
struct BlendFastRays : AlongRays {
    static constexpr char shader[] = "blend_fast_rays";
    using Work = PerTile;
};

/// Marches along every ray, in intervals. Variant: SPEC_KERNEL, SPEC_LENSES, SPEC_MODE (intervals evaluated together).
struct MarchRays : AlongRays {
    static constexpr char shader[] = "march_rays";
};

/// What the gradients of passes along rays read and write, in a strip of each tile. They add to the slot of every
/// (splat, tile) instance, and to Counts.unfinished.
struct AlongRaysBackward : BlendBackwardBuffers {
    using Work = StripPerTile;
    gpu::BufferPart rays, camera, counts;
};

/// Gradient of BlendRays. Variant: SPEC_KERNEL, SPEC_LENSES.
struct BlendRaysBackward : AlongRaysBackward {
    static constexpr char shader[] = "blend_rays_backward";
};

/// Gradient of BlendFastRays. Variant: SPEC_KERNEL, SPEC_LENSES. The slots are zero before.
struct BlendFastRaysBackward : AlongRaysBackward {
    static constexpr char shader[] = "blend_fast_rays_backward";
    using Work = PerTile;
};

/// Gradient of MarchRays. Variant: as of MarchRays.
struct MarchRaysBackward : AlongRaysBackward {
    static constexpr char shader[] = "march_rays_backward";
};

/// Makes records of arrays of 2D Gaussians, 4 channels of their features at a time, with depth keys and tile counts. Adds
/// to Counts.skipped_nonfinite. Variant: SPEC_MODE (COLLECT_* bits, SHAPE_WHITENERS).
struct CollectRecords {
    static constexpr char shader[] = "collect_records";
    using Work = PerElement<&shared::CollectPush::splats>;
    gpu::BufferPart means, shapes, opacities, features, depths, radii, records, depth_keys, tile_counts,
        counts;
};

/// Adds the slots of each splat, and writes the gradient of the arrays that CollectRecords read. Variant: SPEC_MODE
/// (GATHER_* bits, SHAPE_WHITENERS).
struct GatherSlots {
    static constexpr char shader[] = "gather_slots";
    using Work = PerElement<&shared::GatherPush::splats>;
    gpu::BufferPart records, slots, tile_counts, first_instances, sorted_indices, means, shapes, opacities,
        features, absolute;
};

/// Packs the planes of an image. packed: plane_floats words, or four times as many with PACK_FLOATS. Variant: SPEC_MODE (PACK_*).
struct Pack {
    static constexpr char shader[] = "pack";
    struct Work : ElementGroup<shared::PackPush> {
        static Groups groups(const KernelConfig& config, const Push& push) {
            return element_groups(config, push.plane_floats / 4);
        }
    };
    gpu::BufferPart planes, packed;
};

// The loss of a render against a training image, its gradient, and the training image's mask and appearance.

/// Unpacks a training image into planes, over the background. Variant: SPEC_COLOR_FLOATS.
struct UnpackTarget {
    static constexpr char shader[] = "unpack_target";
    using Work = PerElement<texels<shared::UnpackPush>>;
    gpu::BufferPart photo, planes;
};

/// Unpacks a masked training image, and moves a copy of the render towards it where pixels count less.
/// Variant: SPEC_COLOR_FLOATS.
struct MaskImages {
    static constexpr char shader[] = "mask_images";
    using Work = PerElement<pixels<shared::MaskPush>>;
    gpu::BufferPart photo, image, target, masked;
};

/// Gradient of MaskImages, in place. Variant: SPEC_COLOR_FLOATS.
struct MaskGradient {
    static constexpr char shader[] = "mask_gradient";
    using Work = PerElement<pixels<shared::MaskPush>>;
    gpu::BufferPart photo, image_gradient;
};

/// The moments of the SSIM window, blurred down the columns.
struct LossColumns {
    static constexpr char shader[] = "loss_columns";
    using Work = PerElement<loss_column_items, 3>;
    gpu::BufferPart image, target, moments;
};

/// SSIM, its derivatives by the moments, and a row of partial sums of SSIM.
struct LossRows {
    static constexpr char shader[] = "loss_rows";
    using Work = PerElement<loss_row_items<shared::LossPush>, 3>;
    gpu::BufferPart moments, derivatives, partials;
};

/// The derivatives of SSIM, blurred down the columns.
struct LossBackwardColumns {
    static constexpr char shader[] = "loss_backward_columns";
    using Work = PerElement<loss_column_items, 9>;
    gpu::BufferPart derivatives, blurred;
};

/// Gradient of the whole loss by the render, and rows of partial sums: of absolute differences, of squared differences of
/// clamped values, and with LOSS_SQUARES of squared differences. With LOSS_SSIM they follow that of LossRows.
/// Variant: SPEC_MODE (LOSS_* bits).
struct LossBackwardRows {
    static constexpr char shader[] = "loss_backward_rows";
    using Work = PerElement<loss_row_items<shared::LossPush>, 3>;
    gpu::BufferPart blurred, image, target, image_gradient, partials;
};

/// Gradient of the loss by the transmittance, from a training image's alpha, and partial sums of the differences.
/// Variant: SPEC_COLOR_FLOATS.
struct AlphaLoss {
    static constexpr char shader[] = "alpha_loss";
    using Work = PerElement<loss_row_items<shared::AlphaPush>>;
    gpu::BufferPart photo, planes, image_gradient, partials;
};

/// Gradient of the loss by the sums of depths and by the transmittance, from a training image's depth map, and partial sums of
/// the differences. It adds to dL/dT.
struct DepthLoss {
    static constexpr char shader[] = "depth_loss";
    using Work = PerElement<loss_row_items<shared::DepthPush>>;
    gpu::BufferPart planes, depths, image_gradient, partials;
};

/// Sums the floats of each row in a fixed order, so that the sums are reproducible.
struct Reduce {
    static constexpr char shader[] = "reduce";
    struct Work : OneSubgroup<shared::ReducePush> {
        static Groups groups(const KernelConfig& config, const Push& push) {
            return block_groups(config, push.items, push.block, push.rows);
        }
    };
    gpu::BufferPart source, sums, counts;
};

/// Applies a training image's PPISP to the render.
struct Ppisp {
    static constexpr char shader[] = "ppisp";
    struct Work : OneSubgroup<shared::PpispPush> {
        static Groups groups(const KernelConfig& config, const Push& push) {
            return block_groups(config, pixels(push), shared::PPISP_BLOCK);
        }
    };
    gpu::BufferPart image, values, exposed;
};

/// Gradient of Ppisp: by the render in place, by the values as partial sums.
struct PpispBackward {
    static constexpr char shader[] = "ppisp_backward";
    using Work = Ppisp::Work;
    gpu::BufferPart image, values, image_gradient, sums;
};

/// Adam's step of one training image's exposure and colours. slots: each view's gradient of its camera's values.
struct PpispUpdate {
    static constexpr char shader[] = "ppisp_update";
    using Work = OneSubgroup<shared::PpispUpdatePush>;
    gpu::BufferPart sums, values, moments1, moments2, slots, counts;
};

/// Adam's step of one camera's vignette and response.
struct PpispCameraUpdate {
    static constexpr char shader[] = "ppisp_camera_update";
    using Work = OneSubgroup<shared::PpispCameraPush>;
    gpu::BufferPart slots, values, moments1, moments2, counts;
};

/// Applies a training image's bilateral grid to the render. Variant of the three: SPEC_MODE (0 or GRID_ONE_CELL).
struct GridSlice {
    static constexpr char shader[] = "grid_slice";
    using Work = PerElement<pixels<shared::GridPush>>;
    gpu::BufferPart image, grids, exposed;
};

/// Gradient of GridSlice by the render, in place.
struct GridSliceBackward {
    static constexpr char shader[] = "grid_slice_backward";
    using Work = GridSlice::Work;
    gpu::BufferPart image, grids, image_gradient;
};

/// Gradient of GridSlice by the cells, in parts, and of the total variation.
struct GridGradient {
    static constexpr char shader[] = "grid_gradient";
    struct Work : OneSubgroup<shared::GridPush> {
        static Groups groups(const KernelConfig&, const Push& push) {
            return {push.columns, push.parts, push.stacks};
        }
    };
    gpu::BufferPart image, grids, image_gradient, sums;
};

/// Adam's step of one training image's bilateral grid.
struct GridUpdate {
    static constexpr char shader[] = "grid_update";
    using Work = PerElement<&shared::GridUpdatePush::texels>;
    gpu::BufferPart sums, grids, moments1, moments2, counts;
};

// Strategies that change the number of splats: adaptive density control and MCMC.

/// Decides how many splats each splat becomes.
struct DensifyDecide {
    static constexpr char shader[] = "densify_decide";
    using Work = PerElement<&shared::DensifyPush::splats>;
    gpu::BufferPart params, statistics, outputs, moments;
};

/// Writes one array of the next generation of splats. moments: the old array to write with WRITE_MOMENTS.
/// Variant: SPEC_SH_DEGREE (stored), SPEC_MODE (WRITE_*).
struct DensifyWrite {
    static constexpr char shader[] = "densify_write";
    using Work = PerElement<&shared::DensifyPush::splats>;
    gpu::BufferPart params, moments, statistics, prefix, totals, array_out;
};

/// Lowers every opacity to at most a given one and zeroes its moments.
struct ResetOpacity {
    static constexpr char shader[] = "reset_opacity";
    using Work = PerElement<&shared::ResetPush::splats>;
    gpu::BufferPart params, moments1, moments2;
};

/// Writes each splat's weight as a source, and whether it is dead.
struct McmcWeigh {
    static constexpr char shader[] = "mcmc_weigh";
    using Work = PerElement<&shared::McmcPush::splats>;
    gpu::BufferPart params, weights, dead, moments;
};

/// Draws the sources of relocated and added splats, and counts their hits.
struct McmcDraw {
    static constexpr char shader[] = "mcmc_draw";
    using Work = PerElement<&shared::McmcPush::draws>;
    gpu::BufferPart prefix, totals, sources, hits;
};

/// Writes one array of the next generation of splats. moments: the old array to write with WRITE_MOMENTS.
/// prefix, totals: of dead. Variant: SPEC_SH_DEGREE (stored), SPEC_MODE (WRITE_*).
struct McmcWrite {
    static constexpr char shader[] = "mcmc_write";
    using Work = PerElement<&shared::McmcPush::new_splats>;
    gpu::BufferPart params, moments, dead, prefix, totals, sources, hits, array_out;
};

/// Adds noise to the means. values: a PerturbBlock.
struct Perturb {
    static constexpr char shader[] = "perturb";
    using Work = PerElementOfBlock<&shared::PerturbBlock::splats>;
    gpu::BufferPart params, counts, moments, values;
};

// The sky behind the splats.

/// Adds the sky to an image that was blended over black. Variant: SPEC_LENSES.
struct AddSky {
    static constexpr char shader[] = "add_sky";
    using Work = PerElement<pixels<shared::SkyPush>>;
    gpu::BufferPart planes, camera, sky;
};

/// Gradient of AddSky by the sky, which it adds to the slot. Adds to Counts.dropped_updates. Variant: SPEC_LENSES.
struct SkyGradient {
    static constexpr char shader[] = "sky_gradient";
    struct Work : OneSubgroup<shared::SkyGradientPush> {
        static Groups groups(const KernelConfig& config, const Push& push) {
            const auto blocks = [](uint32_t pixels) {
                return (pixels + shared::SKY_BLOCK - 1) / shared::SKY_BLOCK;
            };
            const auto& size = push.sky.image.size;
            return grid_of(config, uint64_t(blocks(size[0])) * blocks(size[1]));
        }
    };
    gpu::BufferPart planes, image_gradient, camera, slots, counts;
};

/// Floats of a sky.
inline uint64_t sky_floats(const shared::SkyUpdatePush& push) {
    return uint64_t(3) * push.size * push.size;
}

/// Adam's step of the sky. before: a copy of the sky.
struct SkyUpdate {
    static constexpr char shader[] = "sky_update";
    using Work = PerElement<sky_floats>;
    gpu::BufferPart slots, before, sky, moments1, moments2, counts;
};

// Ray tracing of mesh scenes. Variant of each: SPEC_ALPHA_TESTED,
// SPEC_COLOR_FLOATS, SPEC_LENSES. The number of workgroups follows from the
// view's pixels, so record takes it. pixel_rays: with SPEC_LENSES the rays of the pixels' corners, row after row.

/// A mesh scene's buffers, bindings 0 to 5; shared/layouts.h describes their contents.
struct MeshBuffers {
    gpu::BufferPart nodes, triangles, surfaces, materials, textures, texels;
};

/// Path tracing: light that reaches a camera.
struct TracePaths {
    static constexpr char shader[] = "trace_paths";
    using Work = ElementGroup<shared::TracePush>;
    MeshBuffers mesh;
    gpu::BufferPart lights, view, sums, counts, pixel_rays;
};

/// The surface at the centre of each pixel.
struct TraceDepth {
    static constexpr char shader[] = "trace_depth";
    using Work = ElementGroup<shared::TracePush>;
    MeshBuffers mesh;
    gpu::BufferPart view, seen, counts, pixel_rays;
};

}  // namespace ewa::passes
