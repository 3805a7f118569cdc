// SPDX-License-Identifier: Apache-2.0
#include "bench/ceiling/ceiling.h"

#include <algorithm>
#include <atomic>
#include <cstring>
#include <mutex>
#include <thread>

namespace ewa::bench {
namespace {

constexpr uint32_t kTilesATurn = 16;

struct BlendVariant {
    BlendTile blend;
    const char* text;
};

BlendVariant best_variant() {
#ifdef EWA_BENCH_X86
    if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("fma"))
        return {blend_tile_avx512, "AVX-512 and FMA"};
    if (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma"))
        return {blend_tile_avx2, "AVX2 and FMA"};
#endif
    return {blend_tile_portable, "portable"};
}

/// Calls visit(tile) for each tile. All threads take the next tiles when they are free.
template <class Visit>
void for_all_tiles(uint32_t tiles, Visit visit) {
    std::atomic<uint32_t> next{0};
    on_threads(host_threads(), [&](unsigned thread) {
        for (;;) {
            const uint32_t begin = next.fetch_add(kTilesATurn);
            if (begin >= tiles) return;
            for (uint32_t tile = begin; tile < std::min(begin + kTilesATurn, tiles); ++tile)
                visit(tile, thread);
        }
    });
}

}  // namespace

std::string vector_text() {
    return best_variant().text;
}

void on_threads(unsigned count, const std::function<void(unsigned)>& work) {
    std::vector<std::thread> threads;
    for (unsigned i = 1; i < count; ++i) threads.emplace_back(work, i);
    work(0);
    for (std::thread& thread : threads) thread.join();
}

Timed time_blend(const BlendLists& lists, uint32_t tiles, int runs, std::vector<float>& planes) {
    planes.assign(size_t(4) * lists.width * lists.height, 0.0f);
    const BlendTile blend = best_variant().blend;
    return time_repeated(runs, [&] {
        for_all_tiles(tiles, [&](uint32_t tile, unsigned) { blend(lists, tile, planes.data()); });
    });
}

PairCounts count_pairs(const BlendLists& lists, uint32_t tiles) {
    std::mutex mutex;
    PairCounts total;
    on_threads(host_threads(), [&](unsigned thread) {
        PairCounts own;
        for (uint32_t tile = thread; tile < tiles; tile += host_threads()) {
            const PairCounts more = count_tile(lists, tile);
            own.evaluated += more.evaluated;
            own.blended += more.blended;
        }
        const std::lock_guard lock(mutex);
        total.evaluated += own.evaluated;
        total.blended += own.blended;
    });
    return total;
}

Bandwidth copy_bandwidth() {
    constexpr size_t kBytes = size_t(128) << 20;
    std::vector<char> source(kBytes, 1), target(kBytes, 2);
    const size_t share = kBytes / host_threads();
    const Timed timed = time_repeated(0, [&] {
        on_threads(host_threads(), [&](unsigned thread) {
            std::memcpy(target.data() + thread * share, source.data() + thread * share, share);
        });
    });
    const double gigabytes = 2e-6 * double(share * host_threads());  // per millisecond
    return {gigabytes / timed.wall.least, gigabytes / timed.cpu.least};
}

}  // namespace ewa::bench
