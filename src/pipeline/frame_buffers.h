// SPDX-License-Identifier: Apache-2.0
// The device buffers of one frame, apart from the model.
#pragma once
#include "gpu/buffer.h"
#include "pipeline/sizes.h"
#include "shared/layouts.h"

namespace ewa::pipeline {

struct FrameBuffers {
    Sizes sizes;  // of the last request
    uint32_t instance_capacity = 0;

    gpu::Buffer counts;  // host visible
    gpu::Buffer records, depth_keys[2], order[2], tile_counts, prefix, scan_totals, first_instances;
    gpu::Buffer counters, counter_prefix, digit_totals;
    gpu::Buffer instance_keys[2], instance_splats[2], sorted_indices[2], tile_starts;
    gpu::Buffer planes, target, exposed, masked, moments, derivatives, blurred, image_gradient, partials,
        exposure_sums, reduced, slots;

    /// Allocates what a request needs. Buffers that are large enough stay. Image planes are zeroed if their
    /// layout changes. Throws what sizes_for and Buffer throw.
    void reserve(gpu::Device& device, const passes::KernelConfig& config, const FrameRequest& request);

    /// The counts of the last submission.
    shared::Counts read_counts() const;
};

}  // namespace ewa::pipeline
