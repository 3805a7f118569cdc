// SPDX-License-Identifier: Apache-2.0
// Capacity for (splat, tile) instances: how much a frame gets at first, and what happens if it needs more.
#pragma once
#include <algorithm>
#include <cstdint>

#include "ewa/error.h"
#include "gpu/executor.h"
#include "passes/pass.h"
#include "pipeline/frame_buffers.h"

namespace ewa::pipeline {

/// Capacity of a first try: most scenes have a few tiles a splat.
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

/// Runs a frame, with more capacity each time, until its instances fit. record: fills a recording.
template <class Record>
shared::Counts run_until_it_fits(passes::PassCache& cache, gpu::Executor& executor, FrameBuffers& frame,
                                 FrameRequest request, Record record) {
    for (;;) {
        frame.reserve(cache.device(), cache.config(), request);
        gpu::Recording recording(cache.device().limits());
        record(recording);
        executor.run(recording, true);
        const shared::Counts counts = frame.read_counts();
        if (counts.instances <= frame.instance_capacity) return counts;
        request.instances = grown_capacity(counts.instances);
    }
}

}  // namespace ewa::pipeline
