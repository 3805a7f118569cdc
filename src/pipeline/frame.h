// SPDX-License-Identifier: Apache-2.0
// Everything on the device that belongs to one frame in the making, not to the model.
#pragma once
#include "gpu/buffer.h"
#include "pipeline/plan.h"
#include "pipeline/sizes.h"
#include "shared/layouts.h"

namespace ewa::pipeline {

struct Frame {
    Sizes sizes;  // of the present image, splats and capacity
    uint32_t splats_capacity = 0, instance_capacity = 0;
    bool gradients = false, depth = false;

    gpu::Buffer counts;  // host visible
    gpu::Buffer records, depth_keys[2], order[2], tile_counts, prefix, scan_totals, first_instances;
    gpu::Buffer counters, counter_prefix, digit_totals;
    gpu::Buffer instance_keys[2], instance_splats[2], instance_places[2], tile_starts;
    gpu::Buffer planes, target, exposed, masked, moments, derivatives, blurred, image_gradient, partials,
        exposure_sums, reduced, slots;

    /// Makes room for a request; buffers that are large enough stay. Buffers that held image padding come
    /// back zeroed. Throws what sizes_for and Buffer throw.
    void reserve(gpu::Device& device, const passes::Shape& shape, const FrameRequest& request);

    /// The counts of the last submission.
    shared::Counts read_counts() const;
};

}  // namespace ewa::pipeline
