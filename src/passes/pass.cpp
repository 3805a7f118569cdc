// SPDX-License-Identifier: Apache-2.0
#include "passes/pass.h"

#include <algorithm>
#include <stdexcept>

#include "passes/shader_code.h"

namespace ewa::shared {

// The scalar block layout packs these structs without padding, and so does C++.
static_assert(sizeof(CameraBlock) == 4 * (9 + 9 + 3 + 3 + 8 + 4 + 4 + 24 + 2 + 9));
static_assert(offsetof(CameraBlock, size) == 4 * (9 + 9 + 3 + 3 + 8 + 4));
static_assert(sizeof(Counts) == 72 && offsetof(Counts, l1) == 16);
static_assert(sizeof(ProjectPush) == 20 && sizeof(SortPush) == 16 && sizeof(ScanPush) == 8);
static_assert(sizeof(ViewBlock) == 184 && sizeof(ViewsPush) == 32 && sizeof(HarmonicsPush) == 16);
static_assert(sizeof(ScanTotalsPush) == 20 && sizeof(EmitPush) == 32 && sizeof(TileStartsPush) == 8);
static_assert(sizeof(BlendPush) == 48 && offsetof(BlendPush, capacity) == 44);
static_assert(sizeof(RayPush) == 56);
static_assert(sizeof(CollectPush) == 20 && sizeof(GatherPush) == 12);
static_assert(sizeof(UnpackPush) == 32 && sizeof(MaskPush) == 20 && sizeof(LossPush) == 36 &&
              sizeof(AlphaPush) == 32 && sizeof(DepthPush) == 32 && sizeof(ReducePush) == 20);
static_assert(sizeof(ImageLayout) == 16 && sizeof(PackPush) == 4);
static_assert(sizeof(PpispPush) == 24 && sizeof(PpispUpdatePush) == 36 && sizeof(PpispCameraPush) == 24 &&
              sizeof(GridPush) == 32 && sizeof(GridUpdatePush) == 32);
static_assert(sizeof(SkyPush) == 24 && sizeof(SkyGradientPush) == 28 && sizeof(SkyUpdatePush) == 24);
static_assert(sizeof(MoveCameraPush) == 8 && sizeof(MotionUpdatePush) == 44);
static_assert(sizeof(UpdateBlock) == 76 && sizeof(DensifyPush) == 96 && sizeof(ResetPush) == 12);
static_assert(sizeof(BandTilesPush) == 16 && sizeof(CollectVisiblePush) == 24 && sizeof(ReceivePush) == 12 &&
              sizeof(SumSlotsPush) == 8 && sizeof(UpdateViewsPush) == 92);
static_assert(sizeof(McmcPush) == 96 && sizeof(PerturbBlock) == 40);
static_assert(sizeof(TraceView) == 4 * (9 + 3 + 2 + 2 + 2 + 9 + 1) && sizeof(TraceCounts) == 8 &&
              sizeof(TracePush) == 24);

}  // namespace ewa::shared

namespace ewa::passes {

const gpu::Pipeline& PassCache::pipeline(std::string_view shader, uint32_t group_size,
                                         const Constants& variant) {
    const auto found = pipelines_.find({shader, variant});
    if (found != pipelines_.end()) return *found->second;
    Constants constants = {{shared::SPEC_GROUP_SIZE, group_size},
                           {shared::SPEC_SUBGROUP, config_.subgroup},
                           {shared::SPEC_TILE_WIDTH, config_.tile_width},
                           {shared::SPEC_TILE_HEIGHT, config_.tile_height},
                           {shared::SPEC_BROADCAST, config_.broadcast},
                           {shared::SPEC_CUT_OFF, std::bit_cast<uint32_t>(config_.cut_off)}};
    constants.insert(constants.end(), variant.begin(), variant.end());
    for (const uint32_t optional :
         {shared::SPEC_SHARP, shared::SPEC_KERNEL, shared::SPEC_PARTS, shared::SPEC_LENSES, shared::SPEC_WRAP,
          shared::SPEC_SLOTS, shared::SPEC_QUADS})
        if (std::ranges::find(variant, optional, &gpu::SpecConstant::id) == variant.end())
            constants.push_back({optional, 0});
    const bool pinhole =
        std::ranges::find(constants, gpu::SpecConstant{shared::SPEC_LENSES, shared::LENSES_PINHOLE}) !=
        constants.end();
    std::span<const uint32_t> code;
    if (config_.optimised_modules && pinhole) code = pinhole_code(shader, config_.texel_buffers);
    const bool without_lenses = !code.empty();
    if (config_.optimised_modules && config_.texel_buffers && code.empty()) code = optimised_code(shader);
    if (code.empty()) code = shader_code(shader, config_.texel_buffers);
    const gpu::Pipeline& made = device_.pipelines().get(device_, std::string(shader), code, constants);
    const std::vector<uint32_t>& declared = made.reflection().constants;
    for (const gpu::SpecConstant& constant : variant)
        if (!std::binary_search(declared.begin(), declared.end(), constant.id) &&
            !(without_lenses && constant.id == shared::SPEC_LENSES))
            throw std::logic_error("shader " + std::string(shader) + " has no specialisation constant " +
                                   std::to_string(constant.id));
    pipelines_.emplace(std::pair(shader, variant), &made);
    return made;
}

}  // namespace ewa::passes
