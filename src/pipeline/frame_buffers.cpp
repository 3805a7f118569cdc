// SPDX-License-Identifier: Apache-2.0
#include "pipeline/frame_buffers.h"

#include <algorithm>
#include <bit>
#include <cstring>
#include <span>
#include <string>
#include <vector>

#include "ewa/error.h"
#include "passes/passes.h"
#include "pipeline/appearances.h"
#include "pipeline/model.h"

namespace ewa::pipeline {
namespace {

using gpu::Texel;

uint32_t divide_up(uint64_t a, uint64_t b) {
    return uint32_t((a + b - 1) / b);
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
                         " tiles that can be drawn; choose a smaller size, or --downscale with a dataset");
}

/// Floats that the passes of a model add up.
uint64_t appearance_sums(AppearanceModel model, const Sizes& s) {
    switch (model) {
        case AppearanceModel::affine:
            return uint64_t(s.grid_parts) * shared::GRID_CELL_FLOATS;
        case AppearanceModel::ppisp:
            return uint64_t(s.ppisp_blocks) * shared::PPISP_SUM_FLOATS;
        case AppearanceModel::grid:
            return uint64_t(s.grid_parts) * shared::GRID_FLOATS;
        default:
            return 0;
    }
}

constexpr uint64_t kAlone = ~uint64_t(0);

// Digits of sorts whose lanes count alone: where one pass then does, with few lanes or many; and otherwise.
constexpr uint32_t kWideDigitBits = 13, kWidestDigitBits = 17, kDigitBits = 8, kDigitBitsOfMany = 11;

struct Allocation {
    gpu::Buffer* buffer;
    const char* name;
    uint64_t bytes;
    Texel texel = Texel::none;
    uint64_t place = kAlone;  // bytes from the beginning of the overlay
};

uint64_t placed(uint64_t bytes) {
    return (bytes + gpu::Buffer::kPlacement - 1) / gpu::Buffer::kPlacement * gpu::Buffer::kPlacement;
}

/// The buffers that may share memory. A frame needs those of one group at a time.
std::vector<Allocation> overlaid(FrameBuffers& f, const Sizes& s) {
    const Texel floats = Texel::rgba32f, words = Texel::rgba32ui;
    const uint64_t splats = placed(s.splat_words), instances = placed(s.instance_words);
    const uint64_t indices = s.slots > 0 && !s.sorted_lists ? s.instance_words : 0;
    const uint64_t sorted_splats = s.slot_order == shared::SLOTS_SORTED ? s.instance_words : 0;
    // Lists that are sorted one by one get the keys while they are filled.
    const uint64_t keys_place = s.sorted_lists ? 2 * instances + placed(sorted_splats) : 0;
    std::vector<Allocation> all{
        // The depth sort, which ends in order[0].
        {&f.depth_keys[0], "depth keys", s.splat_words, words, keys_place},
        {&f.depth_keys[1], "depth keys", s.sorted_words, words, splats},
        {&f.order[1], "order", s.sorted_words, words, 2 * splats},
        // The tile sort or the lists' sorts, which end in instance_splats[1] and sorted_indices[1].
        {&f.instance_keys[0], "instance keys", s.instance_words, words, 0},
        {&f.instance_keys[1], "instance keys", s.instance_words, words, instances},
        {&f.instance_splats[0], "instance splats", sorted_splats, words, 2 * instances},
        {&f.sorted_indices[0], "sorted indices", indices, words, 3 * instances},
        // The loss. It is done with the moments when it blurs their derivatives.
        {&f.moments, "moments", s.moments, floats, 0},
        {&f.derivatives, "derivatives", s.derivatives, floats, placed(s.moments)},
        {&f.blurred, "blurred", s.derivatives, floats, 0},
        // The gradient of blending.
        {&f.slots, "slots", s.slots, floats, 0}};
    // What holds nothing needs no room behind the others.
    for (Allocation& each : all)
        if (each.bytes == 0) each.place = 0;
    return all;
}

/// Bytes of the memory that overlaid buffers share.
uint64_t overlay_bytes(const Sizes& s) {
    FrameBuffers none;
    uint64_t most = 0;
    for (const Allocation& each : overlaid(none, s)) most = std::max(most, each.place + placed(each.bytes));
    return most;
}

/// All buffers of a frame but the counts and those in the overlay. Those that a frame without gradients does not use
/// have no bytes.
std::vector<Allocation> allocations(FrameBuffers& f, const Sizes& s) {
    const bool gradients = s.slots > 0;
    const Texel floats = Texel::rgba32f, words = Texel::rgba32ui;
    std::vector<Allocation> all{
        {&f.overlay, "overlay", s.overlay, Texel::any},
        {&f.records, "records", s.records, floats},
        {&f.rays, "rays", s.rays, floats},
        {&f.order[0], "order", s.sorted_words, words},
        {&f.tile_counts, "tile counts", s.splat_words},
        {&f.prefix, "prefix", s.splat_words},
        {&f.scan_totals, "scan totals", s.scan_totals},
        {&f.lists, "lists", s.lists},
        {&f.counters, "counters", s.counters},
        {&f.counter_prefix, "counter prefix", s.counters},
        {&f.digit_totals, "digit totals", s.digit_totals},
        {&f.instance_splats[1], "instance splats", s.instance_words, words},
        {&f.sorted_indices[1], "sorted indices", gradients ? s.instance_words : 0, words},
        {&f.tile_starts, "tile starts", s.tile_starts},
        // Without gradients no pass reads where a splat's instances begin, but the binding needs a buffer.
        {&f.first_instances, "first instances", gradients ? s.splat_words : 16},
        {&f.planes, "planes", s.planes, floats},
        {&f.target, "target", s.target, floats},
        {&f.exposed, "exposed", s.exposed, floats},
        {&f.masked, "masked", s.masked, floats},
        {&f.image_gradient, "image gradient", s.image_gradient, floats},
        {&f.partials, "partials", s.partial_sums},
        {&f.appearance_sums, "appearance sums", s.appearance_sums},
        {&f.motion_sums, "motion sums", s.motion_sums},
        {&f.motion_reduced, "motion reduced", s.motion_reduced},
        {&f.reduced, "reduced", s.reduced}};
    if (s.overlay == 0)
        for (Allocation& each : overlaid(f, s)) {
            each.place = kAlone;
            all.push_back(each);
        }
    return all;
}

}  // namespace

RadixCut radix_cut(const passes::KernelConfig& config, uint32_t items, uint32_t key_bits) {
    RadixCut cut;
    // Lanes that count in memory of their own can take a wider digit. The widest have few lanes, a workgroup for each
    // CPU thread: the counters of more would not stay in a core's cache. A lane has no fewer items than counters.
    uint32_t lanes_max = config.sort_lanes_max, digit = kDigitBits;
    if (!config.ranked_sort) {
        while (digit < kDigitBitsOfMany && items >> (digit + 1) >= lanes_max) ++digit;
        const uint32_t few =
            lanes_max >> (std::clamp(key_bits, kWideDigitBits, kWideDigitBits + 2) - kWideDigitBits);
        if (key_bits <= kWideDigitBits || (key_bits <= kWidestDigitBits && items >> key_bits >= few)) {
            digit = std::max(digit, key_bits);
            lanes_max = few;
        }
    }
    cut.passes = divide_up(key_bits, digit);
    cut.bits = divide_up(key_bits, cut.passes);
    const uint32_t chunk = std::max(config.sort_chunk, 1u << cut.bits);
    cut.lanes = config.ranked_sort ? std::max(divide_up(items, ranked_keys(config)), 1u)
                                   : std::clamp(divide_up(items, chunk), config.subgroup, lanes_max);
    return cut;
}

namespace {

/// What the loss and its gradient need.
void size_loss(Sizes& s, const passes::KernelConfig& config, const FrameRequest& request) {
    const uint64_t word = 4;
    const auto groups = passes::LossRows::Work::groups(config, {s.image(), 0, 0, 0, {}});
    s.partials = groups[0] * groups[1] * groups[2] * (config.element_group / config.subgroup);
    s.reduce_block = 64 * config.subgroup;
    s.reduce_blocks = divide_up(s.partials, s.reduce_block);
    s.target = uint64_t(s.plane_floats) * 3 * word;
    s.masked = request.masks ? s.target : 0;
    s.exposed = request.appearance != AppearanceModel::none ? s.target : 0;
    s.ppisp_blocks = divide_up(request.width * request.height, shared::PPISP_BLOCK);
    s.grid_parts = grid_parts(request.appearance, request.width, request.height);
    s.appearance_sums = appearance_sums(request.appearance, s) * word;
    if (request.loss.ssim > 0) {
        s.moments = uint64_t(s.plane_floats) * 3 * shared::MOMENT_PLANES * word;
        s.derivatives = uint64_t(s.plane_floats) * 3 * shared::DERIVATIVE_PLANES * word;
    }
    s.image_gradient = uint64_t(s.plane_floats) *
                       (request.loss.depth > 0   ? 5
                        : request.loss.alpha > 0 ? 4
                                                 : 3) *
                       word;
    // See LossBackwardRows.
    const uint64_t rows = 2u + (request.loss.ssim > 0) + (request.loss.l2 > 0);
    s.partial_sums = rows * s.partials * word;
    s.reduced = rows * s.reduce_blocks * word;
}

}  // namespace

uint32_t list_side(const passes::KernelConfig& config, const FrameRequest& request) {
    return config.quads > 0 && request.splatting && request.splats >> shared::PART_SHIFT == 0 ? 2 : 1;
}

Sizes sizes_for(const passes::KernelConfig& config, const FrameRequest& request) {
    Sizes s;
    if (request.width > 1u << 20 || request.height > 1u << 20)
        throw InputError("an image of " + std::to_string(request.width) + "x" +
                         std::to_string(request.height) + " pixels; at most 1048576 a side can be drawn");
    s.width = request.width;
    s.height = request.height;
    const uint32_t side = list_side(config, request);
    if (side > 1) s.quads = config.quads;
    s.tiles_x = divide_up(request.width, config.tile_width * side);
    s.tiles_y = divide_up(request.height, config.tile_height * side);
    const uint64_t tiles = uint64_t(s.tiles_x) * s.tiles_y;
    s.tiles = uint32_t(std::min<uint64_t>(tiles, 0xffffffffu));
    check_image(config, request, s);
    s.stride = divide_up(request.width, 4) * 4;
    s.plane_floats = s.stride * request.height;
    s.scan_block = config.scan_turns * config.subgroup;
    s.scan_blocks = divide_up(std::max(request.splats, 1u), s.scan_block);
    s.sorted_lists = config.sorted_lists > 0 && request.splats <= config.sorted_lists;
    if (!s.sorted_lists) {
        s.depth_sort = radix_cut(config, request.splats, 32);
        // One more than there are tiles: the sentinel tile.
        s.tile_sort = radix_cut(config, request.instances, uint32_t(std::bit_width(s.tiles)));
    }
    s.strip_rows = std::min(s.tiles_y, (config.loop_limit - s.tiles_y) / (s.tiles_x + 2));
    s.image_planes = request.fifth_plane || request.loss.depth > 0 ? 5 : 4;

    const uint64_t word = 4, texel = 16;
    s.records = std::max<uint64_t>(request.splats, 1) * shared::RECORD_TEXELS * texel;
    s.rays = request.rays ? std::max<uint64_t>(request.splats, 1) * shared::RAY_TEXELS * texel : 0;
    s.splat_words = std::max<uint64_t>(request.splats, 1) * word;
    s.sorted_words = s.sorted_lists ? 0 : s.splat_words;
    s.scan_totals = (uint64_t(s.scan_blocks) + 1) * word;
    s.lists = s.sorted_lists ? (uint64_t(s.tiles) + 1) * word : 0;
    s.counters = std::max(counter_words(s.depth_sort), counter_words(s.tile_sort)) * word;
    if (!s.sorted_lists)
        s.digit_totals = ((uint64_t(1) << std::max(s.depth_sort.bits, s.tile_sort.bits)) + 1) * word;
    s.instance_words = std::max<uint64_t>(request.instances, 1) * word;
    s.tile_starts = (uint64_t(s.tiles) + 2) * word;
    s.planes = uint64_t(s.plane_floats) * s.image_planes * word;
    if (request.gradients && request.given_gradient) s.image_gradient = uint64_t(s.plane_floats) * 5 * word;
    if (request.gradients && !request.given_gradient) size_loss(s, config, request);
    if (request.gradients && request.motion) {
        const uint64_t motion_rows = request.readouts ? shared::READOUT_MOTION_VALUES : shared::MOTION_VALUES;
        shared::UpdateBlock push{};
        push.splats = std::max(request.splats, 1u);
        const auto groups = passes::Update::Work::groups(config, push);
        s.motion_items = groups[0] * groups[1] * (config.element_group / config.subgroup);
        s.motion_blocks = divide_up(s.motion_items, s.reduce_block);
        s.motion_sums = motion_rows * s.motion_items * word;
        s.motion_reduced = motion_rows * s.motion_blocks * word;
    }
    if (request.gradients && request.splatting) s.slot_order = config.slots;
    if (request.gradients) {
        const uint32_t slot = request.rays ? shared::RAY_SLOT_FLOATS : shared::SLOT_FLOATS;
        s.slots = std::max<uint64_t>(request.instances, 1) * slot * word;
        if (request.overlaid) s.overlay = overlay_bytes(s);
    }
    return s;
}

uint64_t Sizes::total() const {
    FrameBuffers none;
    uint64_t sum = 0;
    for (const Allocation& each : allocations(none, *this)) sum += each.bytes;
    return sum;
}

void FrameBuffers::reserve_counts(gpu::Device& device, const passes::KernelConfig& config) {
    if (!counts) {
        counts = gpu::Buffer(device, "counts", sizeof(shared::Counts));
        if (!counts.mapped() || config.frames_in_flight > 1)
            counts_copy = gpu::Buffer(device, "counts copy", config.frames_in_flight * sizeof(shared::Counts),
                                      Texel::none, false, true);
    }
    if (update_values) return;
    step_camera = gpu::Buffer(device, "step camera", sizeof(shared::CameraBlock), Texel::none, true);
    update_values = gpu::Buffer(device, "update values", sizeof(shared::UpdateBlock), Texel::none, true);
    noise_values = gpu::Buffer(device, "noise values", sizeof(shared::PerturbBlock), Texel::none, true);
}

void FrameBuffers::reserve(gpu::Device& device, const passes::KernelConfig& config,
                           const FrameRequest& request) {
    const Sizes old = sizes;
    sizes = sizes_for(config, request);
    instance_capacity = request.instances;
    reserve_counts(device, config);
    for (const Allocation& each : allocations(*this, sizes)) {
        if (each.bytes == 0 || each.buffer->bytes() >= each.bytes) continue;
        if (each.buffer == &overlay) free_overlaid();
        *each.buffer = gpu::Buffer();  // free the old one first: its contents are not needed
        *each.buffer = gpu::Buffer(device, each.name, each.bytes, each.texel);
    }
    if (sizes.overlay > 0)
        for (const Allocation& each : overlaid(*this, sizes))
            if (!each.buffer->lies_at(overlay, each.place, each.bytes))
                *each.buffer = gpu::Buffer(overlay, each.place, each.name, each.bytes, each.texel);
    // The loss reads the columns between an image's width and its stride as black. No pass writes them.
    if (old.plane_floats != sizes.plane_floats || old.stride != sizes.stride ||
        old.image_planes != sizes.image_planes) {
        zero(planes);
        if (target) zero(target);
        if (exposed) zero(exposed);
        if (masked) zero(masked);
    }
}

void FrameBuffers::free_overlaid() {
    for (const Allocation& each : overlaid(*this, sizes)) *each.buffer = gpu::Buffer();
    overlay = gpu::Buffer();
}

void FrameBuffers::free_instances() {
    free_overlaid();
    instance_splats[1] = gpu::Buffer();
    sorted_indices[1] = gpu::Buffer();
}

void FrameBuffers::record_counts(gpu::Recording& recording, uint32_t slot) const {
    if (counts_copy)
        recording.copy(counts, 0, counts_copy, slot * sizeof(shared::Counts), sizeof(shared::Counts));
}

shared::Counts FrameBuffers::read_counts(uint32_t slot) const {
    shared::Counts result;
    const gpu::Buffer& readable = counts_copy ? counts_copy : counts;
    std::memcpy(&result, readable.mapped() + slot * sizeof(result), sizeof(result));
    return result;
}

uint32_t first_capacity(size_t splats) {
    // Captures begin with 4 to 6 pairs a splat. For few splats these take little memory, and the first frame runs once.
    const size_t usual = std::min<size_t>(6 * splats, 1u << 18);
    return uint32_t(std::min<size_t>(std::max<size_t>({2 * splats, usual, 4096}), 1u << 24));
}

void check_rays_finished(const shared::Counts& counts) {
    if (counts.unfinished > 0)
        throw RunError(
            "too many splats on one ray to integrate along it: take --integrator splat, fewer --samples, or "
            "fewer "
            "splats");
}

constexpr uint32_t kMostInstances = 0xe0000000u;

uint32_t checked_instances(uint64_t instances) {
    if (instances > kMostInstances)
        throw RunError("more than 3.7 billion (splat, tile) pairs in one picture; a smaller size has fewer");
    return uint32_t(instances);
}

uint32_t grown_capacity(uint32_t needed) {
    const uint64_t checked = checked_instances(needed);
    return uint32_t(std::min<uint64_t>(checked + checked / 8, kMostInstances));
}

}  // namespace ewa::pipeline
