// SPDX-License-Identifier: Apache-2.0
// The pure functions behind a frame: sizes, plans, camera blocks, workgroup counts.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "ewa/error.h"
#include "gpu/test_device.h"
#include "passes/pass.h"
#include "pipeline/frame_buffers.h"
#include "pipeline/frame_inputs.h"
#include "pipeline/model.h"
#include "pipeline/plan.h"
#include "support/random_scene.h"
#include "support/temp_folder.h"

namespace ewa::test {
namespace {

using namespace pipeline;

passes::KernelConfig config_of(uint32_t subgroup, bool cpu = true) {
    gpu::Limits limits;
    limits.subgroup_size = subgroup;
    limits.cpu = cpu;
    limits.threads = 16;
    return passes::config_for(limits);
}

TEST(KernelConfig, TilesAreWholeSubgroupsForEverySubgroupSize) {
    for (const uint32_t subgroup : {1u, 2u, 4u, 8u, 16u, 32u, 64u})
        for (const bool cpu : {false, true}) {
            const passes::KernelConfig config = config_of(subgroup, cpu);
            const uint32_t pixels = config.tile_width * config.tile_height;
            EXPECT_EQ(pixels % subgroup, 0u);
            EXPECT_EQ(pixels, subgroup == 32 && !cpu ? 128u : 64u);
            EXPECT_EQ(subgroup % config.tile_width, 0u);  // rows of lanes
            EXPECT_EQ(config.element_group % subgroup, 0u);
            EXPECT_EQ(config.sort_group % (cpu ? subgroup : 1), 0u);
        }
    for (const uint32_t subgroup : {0u, 3u, 128u}) EXPECT_THROW(config_of(subgroup), std::logic_error);
}

TEST(KernelConfig, GroupsCoverTheItemsWithinTheLimit) {
    passes::KernelConfig config = config_of(8);
    config.max_groups = 10;
    for (const uint64_t items : {uint64_t(0), uint64_t(1), uint64_t(128), uint64_t(129), uint64_t(1280),
                                 uint64_t(1281), uint64_t(12800)}) {
        const auto g = passes::element_groups(config, items, 3);
        EXPECT_GE(uint64_t(g[0]) * g[1] * config.element_group, items);
        EXPECT_LE(g[0], 10u);
        EXPECT_LE(g[1], 10u);
        EXPECT_GE(g[0], 1u);
        EXPECT_EQ(g[2], 3u);
        const auto s = passes::block_groups(config, items, 128);
        EXPECT_GE(uint64_t(s[0]) * s[1], items / 128);
        EXPECT_LE(std::max(s[0], s[1]), 10u);
    }
}

/// Every group of items is some workgroup's, once.
TEST(KernelConfig, EveryDealtItemHasOneWorkgroup) {
    for (const bool cpu : {false, true})
        for (const uint64_t items : {1ull, 128ull, 129ull, 2048ull, 2049ull, 999'999ull, 200'000'000ull}) {
            const passes::KernelConfig config = config_of(8, cpu);
            const auto groups = passes::dealt_groups(config, items, 3);
            EXPECT_LE(std::max(groups[0], groups[1]), config.max_groups);
            EXPECT_EQ(groups[2], 3u);
            // dealt_index counts down the columns: it reaches all of them.
            EXPECT_GE(uint64_t(groups[0]) * groups[1] * config.element_group, items);
            if (cpu) {
                EXPECT_GE(groups[1], config.tile_interleave);
            }
        }
}

TEST(KernelConfig, MoreThreadsSortWithMoreLanes) {
    gpu::Limits limits;
    limits.subgroup_size = 8;
    limits.cpu = true;
    const auto lanes = [&](uint32_t threads) {
        limits.threads = threads;
        return passes::config_for(limits).sort_lanes_max;
    };
    EXPECT_EQ(lanes(1), 64u);
    EXPECT_EQ(lanes(2), 64u);
    EXPECT_EQ(lanes(8), 256u);
    EXPECT_EQ(lanes(128), 512u);
}

/// Every tile is some workgroup's, once.
TEST(KernelConfig, EveryTileHasOneWorkgroup) {
    for (const bool cpu : {false, true})
        for (const uint32_t tiles : {1u, 15u, 16u, 17u, 999u, 70000u}) {
            const passes::KernelConfig config = config_of(8, cpu);
            shared::BlendPush push{};
            push.tiles[0] = tiles;
            push.tiles[1] = 1;
            const auto steps = passes::tile_steps(config, tiles);
            push.tile_step[0] = steps[0];
            push.tile_step[1] = steps[1];
            const auto groups = passes::tile_groups(config, push);
            EXPECT_LE(std::max(groups[0], groups[1]), config.max_groups);
            std::vector<int> owners(tiles);
            for (uint32_t y = 0; y < groups[1]; ++y)
                for (uint32_t x = 0; x < groups[0]; ++x)
                    if (const uint32_t tile = x * steps[0] + y * steps[1]; tile < tiles) ++owners[tile];
            for (uint32_t tile = 0; tile < tiles; ++tile) ASSERT_EQ(owners[tile], 1) << tile;
        }
}

TEST(SizesFor, OddImages) {
    const Sizes one = sizes_for(config_of(8), {1, 1, 1, 1, true, true});
    EXPECT_EQ(one.tiles, 1u);
    EXPECT_EQ(one.stride, 4u);
    EXPECT_EQ(one.plane_floats, 4u);
    EXPECT_EQ(one.image_planes, 5u);
    EXPECT_EQ(one.planes, 80u);
    EXPECT_EQ(one.tile_starts, 12u);  // a tile, the end, and where the stale slots end
    EXPECT_EQ(one.slots, 48u);
    const Sizes odd = sizes_for(config_of(8), {1000, 17, 3, 5000, false, false});
    EXPECT_EQ(odd.tiles_x, 3u);
    EXPECT_EQ(odd.tiles_y, 1u);
    EXPECT_EQ(odd.stride, 20u);
    EXPECT_EQ(odd.plane_floats, 60u);
    EXPECT_EQ(odd.planes, 60u * 4 * 4);
    EXPECT_EQ(odd.records, 1000u * 48);
    EXPECT_EQ(odd.slots, 0u);
    EXPECT_EQ(odd.scan_block, 512u);
    EXPECT_EQ(odd.scan_blocks, 2u);
    EXPECT_EQ(odd.scan_totals, 12u);
}

TEST(SizesFor, NothingHasNoBytes) {
    const Sizes s = sizes_for(config_of(8), {0, 17, 3, 0, true, false});
    for (const uint64_t bytes : {s.records, s.splat_words, s.instance_words, s.slots, s.counters})
        EXPECT_GT(bytes, 0u);
}

TEST(SizesFor, SortsByAsManyBitsAsThereAreTiles) {
    // tiles is itself a key: what was promised and does not exist.
    const auto bits = [](uint32_t width, uint32_t height) {
        const RadixCut cut = sizes_for(config_of(8), {1, width, height, 1000, false, false}).tile_sort;
        return cut.passes * cut.bits;
    };
    EXPECT_EQ(bits(8, 8), 1u);
    EXPECT_EQ(bits(24, 8), 2u);
    EXPECT_EQ(bits(32, 8), 3u);
    EXPECT_EQ(bits(8 * 255, 8), 8u);
    EXPECT_EQ(bits(8 * 256, 8), 9u);
    EXPECT_EQ(bits(8 * 2047, 8), 11u);
    EXPECT_EQ(bits(8 * 4096, 8), 13u);
    EXPECT_EQ(bits(8 * 16384, 8), 16u);  // 15, in two passes of 8
    const RadixCut depth = sizes_for(config_of(8), {1, 8, 8, 1, false, false}).depth_sort;
    EXPECT_EQ(depth.passes * depth.bits, 32u);
}

TEST(SizesFor, AWideDigitSavesAPassWhereLanesCountAlone) {
    passes::KernelConfig config = config_of(8);
    const RadixCut wide = radix_cut(config, 1'000'000, 13), two = radix_cut(config, 1'000'000, 14);
    EXPECT_EQ(radix_cut(config, (512 << 11) - 1, 32).passes, 4u);
    EXPECT_EQ(radix_cut(config, 512 << 11, 32).passes, 3u);  // digits of 11 bits
    EXPECT_EQ(wide.passes, 1u);
    EXPECT_EQ(wide.lanes, (1'000'000 + 8191) / 8192);  // no more counters than items
    EXPECT_EQ(two.passes, 2u);
    EXPECT_EQ(two.lanes, 512u);
    // Many items: one pass of fewer lanes. A lane has as many items as counters.
    for (const auto& [bits, lanes] : {std::pair{14u, 256u}, {15u, 128u}, {16u, 128u}, {17u, 128u}}) {
        const RadixCut cut = radix_cut(config, lanes << bits, bits);
        EXPECT_EQ(cut.passes, 1u);
        EXPECT_EQ(cut.lanes, lanes);
        EXPECT_EQ(radix_cut(config, (lanes << bits) - 1, bits).passes, 2u);
    }
    EXPECT_EQ(radix_cut(config, 512 << 15, 18).passes, 2u);
    const uint32_t many = 512 << 13;
    config.ranked_sort = true;
    EXPECT_EQ(radix_cut(config, 1'000'000, 11).passes, 2u);
    EXPECT_EQ(radix_cut(config, many, 15).passes, 2u);
}

/// Neighbouring lanes go to one thread, so a thread without a workgroup would have nothing to do.
TEST(SizesFor, TheWorkgroupsOfASortInOnePassAreSharedByTheThreads) {
    gpu::Limits limits;
    limits.subgroup_size = 8;
    limits.cpu = true;
    for (const uint32_t threads : {2u, 8u, 16u}) {
        limits.threads = threads;
        const passes::KernelConfig config = passes::config_for(limits);
        for (const auto& [bits, each] : {std::pair{13u, 4u}, {14u, 2u}, {15u, 1u}, {17u, 1u}}) {
            shared::SortPush push{};
            push.lanes = radix_cut(config, 512u << 17, bits).lanes;
            EXPECT_EQ(passes::PerSortLane::groups(config, push)[0], each * threads) << bits << " bits";
        }
    }
}

TEST(SizesFor, LanesAreBetweenASubgroupAndTheMost) {
    const passes::KernelConfig config = config_of(8);
    const auto lanes = [&](uint32_t splats) {
        return sizes_for(config, {splats, 8, 8, 1, false, false}).depth_sort.lanes;
    };
    EXPECT_EQ(lanes(0), 8u);
    EXPECT_EQ(lanes(1), 8u);
    EXPECT_EQ(lanes(512 * 100), 100u);
    EXPECT_EQ(lanes(100'000'000), 512u);
}

TEST(SizesFor, ImagesBeyondTheLimitsAreAnErrorThatNamesThem) {
    const passes::KernelConfig config = config_of(8);
    const auto size = [&](uint32_t width, uint32_t height) {
        return [&config, width, height] { sizes_for(config, {1, width, height, 1, false, false}); };
    };
    expect_error<InputError>(size(0, 5), {"0x5"});
    expect_error<InputError>(size(5, 0), {"5x0"});
    expect_error<InputError>(size((1u << 20) + 1, 5), {"1048577x5", "1048576"});
    expect_error<InputError>(size(5, 0xffffffffu), {"4294967295"});
    expect_error<InputError>(size(1u << 20, 1u << 20), {"1048576x1048576", "524280", "--downscale"});
    expect_error<InputError>(size(8 * 725, 8 * 725), {"524280"});  // 525625 tiles
    EXPECT_NO_THROW(size(8 * 724, 8 * 724)());                     // 524176
    EXPECT_NO_THROW(size(8 * 60000, 8)());
}

/// An emitting lane's loop runs over the tiles of its strip, a turn for each tile and each row; before it,
/// over the rows above.
TEST(SizesFor, StripsKeepLoopsUnderTheLimit) {
    const passes::KernelConfig config = config_of(8);
    for (const auto& [width, height] :
         {std::pair{8u, 8u}, {800u, 600u}, {5792u, 5792u}, {480000u, 8u}, {8u, 480000u}, {64u, 65000u * 8}}) {
        const Sizes s = sizes_for(config, {1, width, height, 1, false, false});
        EXPECT_GE(s.strip_rows, 1u);
        EXPECT_LE(uint64_t(s.strip_rows) * (s.tiles_x + 1), config.loop_limit);
        EXPECT_LE((s.tiles_y + s.strip_rows - 1) / s.strip_rows, config.max_groups);
    }
}

TEST(SizesFor, TotalIsWhatAFrameHolds) {
    auto config = passes::config_for(device()->limits());
    for (const bool gradients : {false, true})
        for (const bool depth : {false, true}) {
            config.sorted_lists = gradients == depth ? 12345 : 0;
            const FrameRequest request{12345, 61, 47, 54321, gradients, depth, gradients};
            pipeline::FrameBuffers frame;
            frame.reserve(*device(), config, request);
            uint64_t held = 0, count = 0;
            for (const gpu::Buffer* b : {&frame.records,
                                         &frame.depth_keys[0],
                                         &frame.depth_keys[1],
                                         &frame.order[0],
                                         &frame.order[1],
                                         &frame.tile_counts,
                                         &frame.prefix,
                                         &frame.scan_totals,
                                         &frame.first_instances,
                                         &frame.lists,
                                         &frame.counters,
                                         &frame.counter_prefix,
                                         &frame.digit_totals,
                                         &frame.instance_keys[0],
                                         &frame.instance_keys[1],
                                         &frame.instance_splats[0],
                                         &frame.instance_splats[1],
                                         &frame.sorted_indices[0],
                                         &frame.sorted_indices[1],
                                         &frame.tile_starts,
                                         &frame.planes,
                                         &frame.target,
                                         &frame.masked,
                                         &frame.moments,
                                         &frame.derivatives,
                                         &frame.blurred,
                                         &frame.image_gradient,
                                         &frame.partials,
                                         &frame.reduced,
                                         &frame.slots}) {
                held += b->bytes();
                ++count;
            }
            // Buffers are rounded up to 16 bytes, and a picture keeps 16 as a stand-in.
            EXPECT_GE(held + 0, frame.sizes.total());
            EXPECT_LE(held, frame.sizes.total() + 16 * count);
        }
}

TEST(SizesFor, OverlaidBuffersShareMemory) {
    const auto config = passes::config_for(device()->limits());
    for (const uint32_t instances : {500u, 54321u}) {  // the loss needs more memory, or the slots do
        const FrameRequest apart{
            .splats = 1234, .width = 61, .height = 47, .instances = instances, .gradients = true};
        FrameRequest request = apart;
        request.overlaid = true;
        pipeline::FrameBuffers frame;
        frame.reserve(*device(), config, request);
        const Sizes& s = frame.sizes;
        const uint64_t most =
            std::max({4 * s.instance_words, 3 * s.splat_words, s.moments + s.derivatives, s.slots});
        EXPECT_GE(s.overlay, most);
        EXPECT_LE(s.overlay, most + 4 * gpu::Buffer::kPlacement);
        EXPECT_EQ(s.total() - s.overlay, sizes_for(config, apart).total() - 4 * s.instance_words -
                                             3 * s.splat_words - s.moments - 2 * s.derivatives - s.slots);
        // Within a group no two share a byte. Across groups they do.
        const std::vector<std::vector<const gpu::Buffer*>> groups{
            {&frame.depth_keys[0], &frame.depth_keys[1], &frame.order[1], &frame.order[0]},
            {&frame.instance_keys[0], &frame.instance_keys[1], &frame.instance_splats[0],
             &frame.instance_splats[1], &frame.sorted_indices[0], &frame.sorted_indices[1], &frame.order[0]},
            {&frame.moments, &frame.derivatives, &frame.instance_splats[1], &frame.sorted_indices[1]},
            {&frame.derivatives, &frame.blurred, &frame.instance_splats[1], &frame.sorted_indices[1]},
            {&frame.slots, &frame.image_gradient, &frame.instance_splats[1], &frame.sorted_indices[1]}};
        for (const auto& group : groups)
            for (const gpu::Buffer* x : group)
                for (const gpu::Buffer* y : group)
                    EXPECT_EQ(x->overlaps(*y), x == y) << x->name() << y->name();
        EXPECT_TRUE(frame.slots.overlaps(frame.moments) && frame.blurred.overlaps(frame.moments));
    }
}

/// Fewer instances than splats: what the lists do not need has no place beyond the others.
TEST(SizesFor, OverlaidBuffersOfSortedListsShareMemory) {
    auto config = passes::config_for(device()->limits());
    config.sorted_lists = 5000;
    for (const uint32_t slots : {shared::SLOTS_SORTED, shared::SLOTS_EMITTED})
        for (const uint32_t instances : {1u, 300u, 9000u}) {
            config.slots = slots;
            pipeline::FrameBuffers frame;
            frame.reserve(*device(), config,
                          {.splats = 4000,
                           .width = 8,
                           .height = 8,
                           .instances = instances,
                           .gradients = true,
                           .overlaid = true,
                           .splatting = true,
                           .loss = {.ssim = 0}});
            EXPECT_EQ(frame.sizes.slot_order, slots);
            const std::vector<const gpu::Buffer*> group{&frame.depth_keys[0],     &frame.instance_keys[0],
                                                        &frame.instance_keys[1],  &frame.instance_splats[1],
                                                        &frame.sorted_indices[1], &frame.tile_counts};
            for (const gpu::Buffer* x : group)
                for (const gpu::Buffer* y : group)
                    EXPECT_EQ(x->overlaps(*y), x == y) << x->name() << y->name();
            if (slots == shared::SLOTS_SORTED) {
                EXPECT_FALSE(frame.instance_splats[0].overlaps(frame.depth_keys[0]) ||
                             frame.instance_splats[0].overlaps(frame.instance_keys[1]));
            }
        }
}

/// The tile sort ends in the second buffers, however many passes it takes.
TEST(FrameReserve, TheTileSortBeginsWhereItEndsInTheSecondBuffers) {
    const auto config = passes::config_for(device()->limits());
    for (const uint32_t width : {8u, 8u * 9000}) {
        pipeline::FrameBuffers frame;
        frame.sizes = sizes_for(config, {1, width, 8, 1, true, false});
        EXPECT_EQ(frame.tile_sort_start(), frame.sizes.tile_sort.passes == 1 ? 0u : 1u);
    }
}

/// Other sizes of image and of lists in the same frame: the parts are laid out anew.
TEST(FrameReserve, LaysOverlaidBuffersOutAnew) {
    const auto config = passes::config_for(device()->limits());
    pipeline::FrameBuffers frame;
    for (const uint32_t instances : {20000u, 9000u, 30000u})
        for (const uint32_t width : {300u, 61u}) {
            frame.reserve(*device(), config,
                          {.splats = 900,
                           .width = width,
                           .height = 47,
                           .instances = instances,
                           .gradients = true,
                           .overlaid = true});
            EXPECT_GE(frame.slots.bytes(), instances * 48u);
            EXPECT_GE(frame.moments.bytes(), frame.sizes.moments);
            EXPECT_FALSE(frame.instance_keys[0].overlaps(frame.instance_keys[1]));
            EXPECT_FALSE(frame.moments.overlaps(frame.derivatives));
        }
    frame.free_instances();
    EXPECT_FALSE(frame.overlay || frame.slots || frame.moments || frame.depth_keys[0] ||
                 frame.instance_splats[1]);
}

TEST(FrameReserve, KeepsBuffersThatAreLargeEnough) {
    const auto config = passes::config_for(device()->limits());
    pipeline::FrameBuffers frame;
    frame.reserve(*device(), config, {1000, 61, 47, 5000, true, false});
    const auto records = frame.records.handle();
    const auto slots = frame.slots.handle();
    frame.reserve(*device(), config, {900, 61, 47, 4000, true, false});
    EXPECT_EQ(frame.records.handle(), records);
    EXPECT_EQ(frame.slots.handle(), slots);
    EXPECT_EQ(frame.instance_capacity, 4000u);
    frame.reserve(*device(), config, {900, 61, 47, 5001, true, false});
    EXPECT_GE(frame.slots.bytes(), 5001u * 48);
}

TEST(Capacity, GrowsPastWhatWasNeeded) {
    EXPECT_EQ(first_capacity(0), 4096u);
    EXPECT_EQ(first_capacity(4000), 24000u);
    EXPECT_EQ(first_capacity(100000), 1u << 18);
    EXPECT_EQ(first_capacity(1000000), 2000000u);
    EXPECT_EQ(first_capacity(1u << 30), 1u << 24);
    EXPECT_EQ(grown_capacity(1000), 1125u);
    EXPECT_GT(grown_capacity(0xe0000000u - 1000), 0xe0000000u - 1000);
    EXPECT_THROW(grown_capacity(0xf0000000u), RunError);
}

PlanRequest request_for(Purpose purpose) {
    PlanRequest request;
    request.purpose = purpose;
    request.scene_degree = 3;
    request.present_degree = 1;
    request.render.kernel = Footprint::antialias;
    return request;
}

TEST(Plan, OfAPictureStoresTheDegreesThatArePresentAndWanted) {
    PlanRequest request = request_for(Purpose::image);
    request.drawing = Drawing::depth;
    const Plan drawn = plan_for(request);
    EXPECT_EQ(drawn.stored_degree, 1);
    EXPECT_EQ(drawn.evaluated_degree(3), 1u);
    EXPECT_EQ(drawn.evaluated_degree(0), 0u);
    EXPECT_EQ(drawn.evaluated_degree(-1), 0u);
    EXPECT_EQ(drawn.drawing, Drawing::depth);
    EXPECT_TRUE(drawn.fifth_plane());
    EXPECT_FALSE(drawn.gradients || drawn.adam || drawn.statistics || drawn.debug);
    EXPECT_EQ(drawn.kernel, Footprint::antialias);
    request.render.sh_degree = 0;
    EXPECT_EQ(plan_for(request).stored_degree, 0);
    request.drawing = Drawing::ellipsoids;
    EXPECT_FALSE(plan_for(request).fifth_plane());
    request.splat_scale = 2;
    EXPECT_EQ(plan_for(request).log_scale_shift, 0);
    request.debug = true;
    EXPECT_EQ(plan_for(request).log_scale_shift, float(std::log(2.0)));
}

/// A gradient is written for every stored coefficient.
TEST(Plan, OfAGradientStoresEveryDegree) {
    PlanRequest request = request_for(Purpose::gradient);
    request.render.sh_degree = 0;
    request.masks = true;
    const Plan gradient = plan_for(request);
    EXPECT_EQ(gradient.stored_degree, 3);
    EXPECT_TRUE(gradient.gradients && gradient.masks);
    EXPECT_FALSE(gradient.adam || gradient.statistics || gradient.motion);
    EXPECT_EQ(gradient.appearance, AppearanceModel::none);
}

TEST(Plan, OfATrainingHasWhatItsStrategyAndItsImagesNeed) {
    PlanRequest request = request_for(Purpose::training);
    const Plan plain = plan_for(request);
    EXPECT_TRUE(plain.gradients && plain.adam);
    EXPECT_FALSE(plain.statistics || plain.absolute || plain.regularised || plain.masks || plain.motion ||
                 plain.sky);
    EXPECT_EQ(plain.stored_degree, 3);
    request.absolute_gradients = true;
    EXPECT_EQ(plan_for(request), plain);  // nobody reads them without statistics
    request.statistics = true;
    EXPECT_TRUE(plan_for(request).statistics && plan_for(request).absolute);
    request = request_for(Purpose::training);
    request.regularised = request.masks = request.motion = request.sky = true;
    request.appearance = AppearanceModel::ppisp;
    const Plan other = plan_for(request);
    EXPECT_TRUE(other.regularised && other.masks && other.motion && other.sky);
    EXPECT_EQ(other.appearance, AppearanceModel::ppisp);
    EXPECT_FALSE(other.statistics);
}

/// What does not apply to a purpose changes nothing.
TEST(Plan, IgnoresTheInputsOfOtherPurposes) {
    PlanRequest request = request_for(Purpose::image);
    const Plan drawn = plan_for(request);
    request.masks = request.motion = request.statistics = request.regularised = request.sky = true;
    request.appearance = AppearanceModel::grid;
    request.loss = {1, 0, 0};
    EXPECT_EQ(plan_for(request), drawn);
    request = request_for(Purpose::training);
    const Plan training = plan_for(request);
    request.drawing = Drawing::count;
    request.debug = true;
    EXPECT_EQ(plan_for(request), training);
    request = request_for(Purpose::gradient);
    const Plan gradient = plan_for(request);
    request.statistics = request.regularised = true;
    EXPECT_EQ(plan_for(request), gradient);
}

TEST(Plan, HasAsManyBuffersOfMomentsAsItNeeds) {
    PlanRequest request = request_for(Purpose::training);
    EXPECT_EQ(plan_for(request).moment_buffers(), 2);
    request.packed_moments = true;
    EXPECT_EQ(plan_for(request).moment_buffers(), 1);
    request.purpose = Purpose::gradient;
    EXPECT_EQ(plan_for(request).moment_buffers(), 1);
    EXPECT_FALSE(plan_for(request).packed_moments);
    request.purpose = Purpose::image;
    EXPECT_EQ(plan_for(request).moment_buffers(), 0);
}

TEST(Plan, IsDescribedByWhatItSkips) {
    const auto skips = [](const Plan& plan, const std::string& what) {
        const auto lines = describe(plan, 3, 10);
        return std::any_of(lines.begin(), lines.end(),
                           [&](const PlanLine& line) { return line.what == what; });
    };
    const auto lines = describe(plan_for(request_for(Purpose::image)), 3, 10);
    EXPECT_EQ(lines[0].what, "SH degrees 2 to 3");
    EXPECT_EQ(lines[0].bytes_saved,
              (15 - 6) * 16 * 16u);  // planes of 59 and of 23 floats, two blocks of 8 splats
    PlanRequest request = request_for(Purpose::training);
    EXPECT_TRUE(skips(plan_for(request), "densification statistics"));
    EXPECT_TRUE(skips(plan_for(request), "opacity and scale regularisers"));
    EXPECT_TRUE(skips(plan_for(request), "largest weights of splats in the training images"));
    request.pruned = true;
    EXPECT_FALSE(skips(plan_for(request), "largest weights of splats in the training images"));
    EXPECT_FALSE(skips(plan_for(request), "Adam's moments"));
    EXPECT_FALSE(skips(plan_for(request), "half of the bits of Adam's moments"));
    request.packed_moments = true;
    EXPECT_TRUE(skips(plan_for(request), "half of the bits of Adam's moments"));
    request.statistics = request.regularised = true;
    EXPECT_TRUE(skips(plan_for(request), "sums of absolute gradients"));
    EXPECT_TRUE(skips(plan_for(request), "gradient of the camera and its passes"));
    request.masks = request.motion = request.absolute_gradients = true;
    request.appearance = AppearanceModel::affine;
    for (const char* what :
         {"densification statistics", "opacity and scale regularisers", "sums of absolute gradients",
          "mask passes and the masked image", "appearance of images, its passes and the image as shown",
          "gradient of the camera and its passes"})
        EXPECT_FALSE(skips(plan_for(request), what)) << what;
}

TEST(CameraBlock, PairsOfFloatsHoldTheDoubles) {
    Camera camera = random_camera(2, 161, 119);
    camera.translation = {1e6 + 0.123456789, -2e6 + 1.0 / 3, 5e5};
    const shared::CameraBlock block = camera_block(camera, config_of(4));
    const auto whole = [](float high, float low) { return double(high) + double(low); };
    const auto close = [](double actual, double expected) {
        // Two floats hold 48 bits.
        EXPECT_NEAR(actual, expected, std::abs(expected) * std::ldexp(1.0, -47));
    };
    const glm::dvec3 position = camera.position();
    for (int i = 0; i < 3; ++i) {
        close(whole(block.position_hi[i], block.position_lo[i]), position[i]);
        EXPECT_EQ(block.position_hi[i], float(position[i]));
        for (int j = 0; j < 3; ++j)  // rows of the matrix
            close(whole(block.rotation_hi[3 * i + j], block.rotation_lo[3 * i + j]), camera.rotation[j][i]);
    }
    close(whole(block.focal_hi[0], block.focal_lo[0]), camera.fx);
    close(whole(block.focal_hi[1], block.focal_lo[1]), camera.fy);
    close(whole(block.center_hi[0], block.center_lo[0]), camera.cx);
    close(whole(block.center_hi[1], block.center_lo[1]), camera.cy);
    EXPECT_FLOAT_EQ(block.tan_min[0], float(-(camera.cx + 0.15 * 161) / camera.fx));
    EXPECT_FLOAT_EQ(block.tan_max[0], float((161 - camera.cx + 0.15 * 161) / camera.fx));
    EXPECT_FLOAT_EQ(block.tan_min[1], float(-(camera.cy + 0.15 * 119) / camera.fy));
    EXPECT_FLOAT_EQ(block.tan_max[1], float((119 - camera.cy + 0.15 * 119) / camera.fy));
    EXPECT_EQ(block.size[0], 161u);
    EXPECT_EQ(block.tiles[0], 41u);  // tiles of 4 x 16
    EXPECT_EQ(block.tiles[1], 8u);
}

TEST(CameraBlock, RefusesWhatIsNoCamera) {
    const Camera good = random_camera(3, 64, 48);
    const auto refuses = [&](auto change) {
        Camera camera = good;
        change(camera);
        EXPECT_THROW(camera_block(camera, config_of(8)), InputError);
    };
    const double nan = std::nan(""), inf = std::numeric_limits<double>::infinity();
    refuses([](Camera& c) { c.width = 0; });
    refuses([](Camera& c) { c.height = -3; });
    refuses([](Camera& c) { c.fx = 0; });
    refuses([&](Camera& c) { c.fy = inf; });
    refuses([&](Camera& c) { c.fx = nan; });
    refuses([&](Camera& c) { c.cx = nan; });
    refuses([&](Camera& c) { c.cy = inf; });
    refuses([&](Camera& c) { c.rotation[1][2] = nan; });
    refuses([&](Camera& c) { c.translation.z = inf; });
    EXPECT_NO_THROW(camera_block(good, config_of(8)));
}

TEST(SubgroupLanes, AreTheDevicesOwnUpToATile) {
    EXPECT_EQ(gpu::subgroup_lanes(32, 32, 32), 32u);      // NVIDIA
    EXPECT_EQ(gpu::subgroup_lanes(8, 8, 8), 8u);          // lavapipe
    EXPECT_EQ(gpu::subgroup_lanes(32, 8, 32), 16u);       // Intel
    EXPECT_EQ(gpu::subgroup_lanes(64, 32, 64), 64u);      // AMD
    EXPECT_EQ(gpu::subgroup_lanes(128, 64, 128), 64u);    // Adreno
    EXPECT_EQ(gpu::subgroup_lanes(128, 128, 128), 128u);  // unusable, as `ewa devices` says
}

}  // namespace
}  // namespace ewa::test
