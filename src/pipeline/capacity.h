// SPDX-License-Identifier: Apache-2.0
// Room for (splat, tile) instances: how much is taken at first, and what happens when a frame needs more.
#pragma once
#include <algorithm>
#include <cstdint>

#include "ewa/error.h"
#include "gpu/executor.h"
#include "pipeline/frame.h"
#include "pipeline/kernels.h"

namespace ewa::pipeline {

/// Room for instances in a first try: most scenes have a few tiles a splat.
inline uint32_t first_capacity(size_t splats) {
    return uint32_t(std::min<size_t>(std::max<size_t>(8 * splats, 4096), 1u << 24));
}

inline uint32_t grown_capacity(uint32_t needed) {
    constexpr uint32_t kMost = 0xe0000000u;
    if (needed > kMost)
        throw RunError(
            "more than 3.7 billion (splat, tile) pairs in one picture; --downscale makes them fewer");
    return uint32_t(std::min<uint64_t>(uint64_t(needed) + needed / 4, kMost));
}

/// Runs a frame until its instances fit. record: fills a recording for the frame as reserved.
template <class Record>
shared::Counts run_until_it_fits(Kernels& kernels, gpu::Executor& executor, Frame& frame,
                                 FrameRequest request, Record record) {
    for (;;) {
        frame.reserve(kernels.device(), kernels.shape(), request);
        gpu::Recording recording(kernels.device().limits());
        record(recording);
        executor.run(recording, true);
        const shared::Counts counts = frame.read_counts();
        if (counts.instances <= frame.instance_capacity) return counts;
        request.instances = grown_capacity(counts.instances);
    }
}

}  // namespace ewa::pipeline
