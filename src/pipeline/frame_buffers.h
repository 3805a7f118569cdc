// SPDX-License-Identifier: Apache-2.0
// The device buffers of one frame, apart from the model. The sizes of all buffers and dispatches come from
// one pure function.
#pragma once
#include <cstdint>

#include "ewa/appearance.h"
#include "ewa/loss_weights.h"
#include "gpu/executor.h"
#include "passes/pass.h"

namespace ewa::pipeline {

struct FrameRequest {
    uint32_t splats = 0;
    uint32_t width = 0, height = 0;  // px
    uint32_t instances = 0;          // capacity for (splat, tile) pairs
    bool gradients = false;
    bool fifth_plane = false;  // a fifth image plane: depth, count or median depth
    bool masks = false;        // with gradients: some pixels count less
    // With gradients: the appearance that is applied to the render before the loss.
    AppearanceModel appearance = AppearanceModel::none;
    // With gradients: dL/d(image) comes from outside, in 5 planes. There are no buffers for a loss.
    bool given_gradient = false;
    // With gradients: buffers that are not needed at the same time share memory. All requests of a frame have the same value.
    bool overlaid = false;
    bool motion = false;     // with gradients: also the gradient of the camera's motion
    bool readouts = false;   // with motion: also the gradient of the motion during a readout
    bool rays = false;       // splats are integrated along rays
    bool splatting = false;  // blending has the lists and slots that KernelConfig chooses
    LossWeights loss{};      // with gradients: a term of weight 0 has no buffers
};

/// How a radix sort is divided into lanes and passes.
struct RadixCut {
    uint32_t lanes = 0;             // lanes, or workgroups that rank in shared memory: SortPush
    uint32_t passes = 0, bits = 0;  // bits of the key for each pass
};
RadixCut radix_cut(const passes::KernelConfig& config, uint32_t items, uint32_t key_bits);

struct Sizes {
    uint32_t width = 0, height = 0;                // px
    uint32_t tiles_x = 0, tiles_y = 0, tiles = 0;  // that have a list
    uint32_t stride = 0, plane_floats = 0;         // of an image plane
    uint32_t scan_block = 0, scan_blocks = 0;      // of the prefix sum over tile counts
    bool sorted_lists = false;                     // in place of the next two
    RadixCut depth_sort, tile_sort;
    uint32_t strip_rows = 0;  // tile rows of an emitting lane
    uint32_t image_planes = 0;
    uint32_t slot_order = shared::SLOTS_SORTED;  // SPEC_SLOTS
    uint32_t quads = 0;                          // SPEC_QUADS
    uint32_t partials = 0;                       // partial sums in a row of a loss kernel
    uint32_t reduce_block = 0, reduce_blocks = 0;
    uint32_t ppisp_blocks = 0;  // of pixels, for the gradient of PPISP's values
    uint32_t grid_parts = 0;    // of pixels, for the gradient of the bilateral grid
    uint32_t motion_items = 0;  // subgroups that sum the gradient of the camera's motion
    uint32_t motion_blocks = 0;

    // Bytes.
    uint64_t records = 0, splat_words = 0, sorted_words = 0, lists = 0, scan_totals = 0, counters = 0,
             digit_totals = 0;
    uint64_t instance_words = 0, tile_starts = 0, planes = 0, target = 0;
    uint64_t masked = 0, exposed = 0, moments = 0, derivatives = 0, image_gradient = 0, partial_sums = 0,
             appearance_sums = 0, motion_sums = 0, motion_reduced = 0, reduced = 0, slots = 0, rays = 0;
    uint64_t overlay = 0;  // of the memory that overlaid buffers share

    uint64_t total() const;  // of all buffers of a frame with this request

    shared::ImageLayout image() const { return {{width, height}, stride, plane_floats}; }
};

/// Tiles along each side of what has a list: 2 with quads, else 1.
uint32_t list_side(const passes::KernelConfig& config, const FrameRequest& request);

/// Throws InputError that names the limit if the image is empty, or larger than tile indices
/// and loop limits allow.
Sizes sizes_for(const passes::KernelConfig& config, const FrameRequest& request);

struct FrameBuffers {
    Sizes sizes;  // of the last request
    uint32_t instance_capacity = 0;

    gpu::Buffer counts;  // in device memory, since every splat adds to them
    /// Host-visible copies of counts, one for each of frames_in_flight frames. Empty if the host can read `counts` itself.
    gpu::Buffer counts_copy;
    // What differs from step to step of a training, for commands that are replayed: the view's CameraBlock, the UpdateBlock and
    // the PerturbBlock.
    gpu::Buffer step_camera, update_values, noise_values;
    gpu::Buffer records, depth_keys[2], order[2], tile_counts, prefix, scan_totals, first_instances;
    gpu::Buffer counters, counter_prefix, digit_totals;
    gpu::Buffer lists;  // with sorted_lists: each tile's length, then the place of its next instance
    gpu::Buffer instance_keys[2], instance_splats[2], sorted_indices[2], tile_starts;
    gpu::Buffer planes, target, exposed, masked, moments, derivatives, blurred, image_gradient, partials,
        appearance_sums, motion_sums, motion_reduced, reduced, slots, rays;
    // With FrameRequest::overlaid. Its memory is used in turn for the pairs of the depth sort, those of the tile sort, the loss
    // planes, and the gradient slots.
    gpu::Buffer overlay;

    /// Allocates the buffers that a request needs. Buffers that are large enough stay. Image planes are zeroed if their layout
    /// changes. Throws as sizes_for and gpu::Buffer do.
    void reserve(gpu::Device& device, const passes::KernelConfig& config, const FrameRequest& request);
    /// Allocates the buffers whose size depends on no request. reserve does it too.
    void reserve_counts(gpu::Device& device, const passes::KernelConfig& config);
    /// Frees all buffers whose size depends on the number of instances, and those that share their memory, until the
    /// next reserve.
    void free_instances();

    /// Which of each two buffers of keys, splats and indices the tile sort reads first. The sort ends in buffer 1. Buffer 0 is
    /// unused afterwards and may be overlaid.
    uint32_t tile_sort_start() const {
        return !sizes.sorted_lists && sizes.tile_sort.passes % 2 == 0 ? 1 : 0;
    }
    /// Whether the tile sort moves the emitted instances' numbers alone. Their splats stay in instance_splats[1].
    bool slots_emitted() const { return sizes.slot_order == shared::SLOTS_EMITTED; }
    const gpu::Buffer& emitted_splats() const {
        return instance_splats[slots_emitted() ? 1 : tile_sort_start()];
    }

    /// Frees the overlay with all buffers in it. Without overlaid, frees the same buffers one by one.
    void free_overlaid();
    /// The last command of a frame: lets the host read the counts. slot: which of the frames in flight it is.
    void record_counts(gpu::Recording& recording, uint32_t slot = 0) const;
    /// The counts of the last submission with record_counts for this slot, which must be done.
    shared::Counts read_counts(uint32_t slot = 0) const;
};

/// Capacity for (splat, tile) instances before any frame has counted them.
uint32_t first_capacity(size_t splats);

/// Returns the number of instances. Throws RunError if an image cannot have so many.
uint32_t checked_instances(uint64_t instances);

/// The next capacity if a frame needs `needed` instances. Throws RunError beyond what an image can have.
uint32_t grown_capacity(uint32_t needed);

/// Throws RunError if the rays of a tile met more splats than one invocation may loop over.
void check_rays_finished(const shared::Counts& counts);

/// Runs the commands that record(Recorder) records. Repeats them with more capacity until all instances fit.
template <class Record>
shared::Counts run_until_it_fits(passes::PassCache& cache, gpu::Executor& executor, FrameBuffers& frame,
                                 FrameRequest request, Record record) {
    for (;;) {
        frame.reserve(cache.device(), cache.config(), request);
        gpu::Recording recording(cache.device().limits());
        record(passes::Recorder{recording, cache});
        frame.record_counts(recording);
        executor.run(recording, true);
        const shared::Counts counts = frame.read_counts();
        if (counts.instances <= frame.instance_capacity) {
            check_rays_finished(counts);
            return counts;
        }
        request.instances = grown_capacity(counts.instances);
    }
}

}  // namespace ewa::pipeline
