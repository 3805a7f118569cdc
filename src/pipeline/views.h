// SPDX-License-Identifier: Apache-2.0
// Buffers for a step of several views. Each view draws a list of the splats that it sees. Then one update adds the gradients of all
// views to each splat, in the order of the views. Model and render exchange only a view's list and its sums, so another process may
// draw the view. A view may be cut into bands, which have a list each.
#pragma once
#include <cstdint>
#include <span>

#include "gpu/executor.h"
#include "pipeline/backward.h"

namespace ewa::pipeline {

struct ViewBuffers {
    gpu::Buffer cameras;       // CameraBlocks, one view after another
    gpu::Buffer list_indices;  // for each list, a word per splat: list index over all lists, or NOT_LISTED
    gpu::Buffer visible;       // records of one list or several
    gpu::Buffer sums;          // sums of gradients by list index: see SUM_FLOATS

    /// Size in bytes of `sums` for `splats` listed splats.
    static uint64_t sum_bytes(const Plan& plan, uint64_t splats);
    /// Size in bytes of all buffers for a step of `views` views, if each view sees `splats` splats, and each splat is in at most
    /// two bands.
    static uint64_t most_bytes(const Plan& plan, uint64_t splats, uint64_t views, uint64_t bands);

    /// Makes room for the list indices of `splats` splats in `bands` bands of `views` views, and for `records` records.
    void reserve(gpu::Device& device, uint32_t splats, uint32_t views, uint32_t bands, uint32_t records);
    /// Makes room for the sums of `splats` listed splats. Sums that the buffer has already stay. The device must be idle.
    void reserve_sums(gpu::Device& device, gpu::Executor& executor, const Plan& plan, uint64_t splats);
};

/// The place of a list in a step and in ViewBuffers.
struct ListStart {
    uint32_t view = 0, list = 0;
    uint32_t first_index = 0;   // number of splats in all earlier lists
    uint32_t first_record = 0;  // index of the list's first record in ViewBuffers::visible
};

/// The rates of a step of rates.views views, from those of a step of one view (Zhao et al. 2024, Grendel, section 3.3): rates times
/// the square root of the number of views.
Rates batch_rates(const Rates& rates);

}  // namespace ewa::pipeline
