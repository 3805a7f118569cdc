// SPDX-License-Identifier: Apache-2.0
#include "pipeline/sizes.h"

#include <algorithm>
#include <bit>
#include <string>

#include "ewa/error.h"
#include "shared/layouts.h"

namespace ewa::pipeline {
namespace {

uint32_t divide_up(uint64_t a, uint64_t b) {
    return uint32_t((a + b - 1) / b);
}

RadixCut radix_cut(const passes::KernelConfig& config, uint32_t items, uint32_t key_bits) {
    RadixCut cut;
    cut.lanes = std::clamp(divide_up(items, config.sort_chunk), config.subgroup, config.sort_lanes_max);
    cut.passes = divide_up(key_bits, 8);
    cut.bits = divide_up(key_bits, cut.passes);
    return cut;
}

uint64_t counter_words(const RadixCut& cut) {
    return uint64_t(cut.lanes) << cut.bits;
}

void check_image(const passes::KernelConfig& config, const FrameRequest& request, const Sizes& sizes) {
    const std::string size = std::to_string(request.width) + "x" + std::to_string(request.height);
    if (request.width == 0 || request.height == 0) throw InputError("an image of " + size + " pixels");
    // The loops that limit the size: over a splat's tile rows, and in training over its instances,
    // 8 at a time.
    const uint64_t most_tiles = uint64_t(8) * config.loop_limit;
    if (sizes.tiles_x + sizes.tiles_y + 2 > config.loop_limit || sizes.tiles > most_tiles)
        throw InputError("an image of " + size + " pixels has more than the " + std::to_string(most_tiles) +
                         " tiles that can be drawn; --downscale makes it smaller");
}

}  // namespace

Sizes sizes_for(const passes::KernelConfig& config, const FrameRequest& request) {
    Sizes s;
    if (request.width > 1u << 20 || request.height > 1u << 20)
        throw InputError("an image of " + std::to_string(request.width) + "x" +
                         std::to_string(request.height) + " pixels; at most 1048576 a side can be drawn");
    s.width = request.width;
    s.height = request.height;
    s.tiles_x = divide_up(request.width, config.tile_width);
    s.tiles_y = divide_up(request.height, config.tile_height);
    const uint64_t tiles = uint64_t(s.tiles_x) * s.tiles_y;
    s.tiles = uint32_t(std::min<uint64_t>(tiles, 0xffffffffu));
    check_image(config, request, s);
    s.stride = divide_up(request.width, 4) * 4;
    s.plane_floats = s.stride * request.height;
    s.scan_block = 64 * config.subgroup;
    s.scan_blocks = divide_up(std::max(request.splats, 1u), s.scan_block);
    s.depth_sort = radix_cut(config, request.splats, 32);
    // One more than there are tiles: the sentinel tile.
    s.tile_sort = radix_cut(config, request.instances, uint32_t(std::bit_width(s.tiles)));
    s.strip_rows = std::min(s.tiles_y, (config.loop_limit - s.tiles_y) / (s.tiles_x + 2));
    s.image_planes = request.fifth_plane ? 5 : 4;

    const uint64_t word = 4, texel = 16;
    s.records = std::max<uint64_t>(request.splats, 1) * shared::RECORD_TEXELS * texel;
    s.splat_words = std::max<uint64_t>(request.splats, 1) * word;
    s.scan_totals = (uint64_t(s.scan_blocks) + 1) * word;
    s.counters = std::max(counter_words(s.depth_sort), counter_words(s.tile_sort)) * word;
    s.digit_totals = (shared::RADIX_DIGITS_MAX + 1) * word;
    s.instance_words = std::max<uint64_t>(request.instances, 1) * word;
    s.tile_starts = (uint64_t(s.tiles) + 2) * word;
    s.planes = uint64_t(s.plane_floats) * s.image_planes * word;
    if (request.gradients) {
        const auto groups =
            passes::element_groups(config, passes::loss_row_items(s.stride, request.height), 3);
        s.partials = groups[0] * groups[1] * groups[2] * (config.element_group / config.subgroup);
        s.reduce_block = 64 * config.subgroup;
        s.reduce_blocks = divide_up(s.partials, s.reduce_block);
        s.target = uint64_t(s.plane_floats) * 3 * word;
        s.masked = request.masks ? s.target : 0;
        s.exposed = request.exposure ? s.target : 0;
        s.exposure_blocks = divide_up(request.width * request.height, shared::EXPOSURE_BLOCK);
        s.exposure_sums = request.exposure ? uint64_t(s.exposure_blocks) * shared::EXPOSURE_FLOATS * word : 0;
        s.moments = uint64_t(s.plane_floats) * 3 * shared::MOMENT_PLANES * word;
        s.derivatives = uint64_t(s.plane_floats) * 3 * shared::DERIVATIVE_PLANES * word;
        s.image_gradient = s.target;
        s.partial_sums = uint64_t(s.partials) * word;
        s.reduced = uint64_t(s.reduce_blocks) * word;
        s.slots = std::max<uint64_t>(request.instances, 1) * shared::SLOT_FLOATS * word;
    }
    return s;
}

uint64_t Sizes::total() const {
    const bool gradients = slots > 0;
    // 2 depth keys, 2 order, tile counts, prefix; in training also the first instances
    const uint64_t per_splat = records + splat_words * (gradients ? 7 : 6);
    const uint64_t sorting = scan_totals + 2 * counters + digit_totals;
    // 2 keys, 2 splats; in training also 2 sorted indices
    const uint64_t per_instance = instance_words * (gradients ? 6 : 4) + slots;
    return per_splat + sorting + per_instance + tile_starts + planes + target + masked + exposed + moments +
           2 * derivatives + image_gradient + partial_sums + exposure_sums + reduced;
}

}  // namespace ewa::pipeline
