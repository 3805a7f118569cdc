// SPDX-License-Identifier: Apache-2.0
#include "bench/ceiling/ceiling.h"

#include <algorithm>
#include <condition_variable>
#include <cstring>
#include <mutex>
#include <thread>
#include <utility>

#include "core/random.h"

namespace ewa::bench {
namespace {

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

constexpr uint32_t kDigitBits = 11;
constexpr size_t kFewestOfAThread = 32768;  // fewer items are sorted faster than a thread starts

struct Pairs {
    std::vector<uint32_t> keys, values;
    void resize(size_t items) {
        keys.resize(items);
        values.resize(items);
    }
};

/// One pass. Each thread owns a contiguous share of the items and counts its digits. The counts of all
/// threads tell where its items of each digit go.
void sort_pass(const Pairs& from, Pairs& to, uint32_t shift, uint32_t digits, std::vector<uint32_t>& counts) {
    const size_t items = from.keys.size();
    const unsigned threads = unsigned(std::clamp<size_t>(items / kFewestOfAThread, 1, host_threads()));
    const size_t share = (items + threads - 1) / threads;
    const uint32_t mask = digits - 1;
    counts.assign(size_t(threads) * digits, 0);
    // With MinGW a thread may wait for ever at a std::barrier, since its atomics miss a notification.
    std::mutex mutex;
    std::condition_variable all_counted;
    unsigned counted = 0;
    on_threads(threads, [&](unsigned thread) {
        const size_t begin = std::min(thread * share, items), end = std::min(begin + share, items);
        uint32_t* own = &counts[size_t(thread) * digits];
        for (size_t i = begin; i < end; ++i) ++own[(from.keys[i] >> shift) & mask];
        std::unique_lock lock(mutex);
        if (++counted == threads) {
            uint32_t sum = 0;
            for (uint32_t digit = 0; digit < digits; ++digit)
                for (unsigned t = 0; t < threads; ++t)
                    sum += std::exchange(counts[size_t(t) * digits + digit], sum);
            all_counted.notify_all();
        }
        all_counted.wait(lock, [&] { return counted == threads; });
        lock.unlock();
        for (size_t i = begin; i < end; ++i) {
            const uint32_t place = own[(from.keys[i] >> shift) & mask]++;
            to.keys[place] = from.keys[i];
            to.values[place] = from.values[i];
        }
    });
}

void sort_in_place(Pairs& pairs, Pairs& scratch, uint32_t bits, std::vector<uint32_t>& counts) {
    const uint32_t passes = (bits + kDigitBits - 1) / kDigitBits;
    const uint32_t digit_bits = (bits + passes - 1) / passes;
    for (uint32_t pass = 0; pass < passes; ++pass) {
        sort_pass(pairs, scratch, pass * digit_bits, 1u << digit_bits, counts);
        std::swap(pairs, scratch);
    }
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
    return time_repeated(runs,
                         [&] { for_all(tiles, [&](uint32_t tile) { blend(lists, tile, planes.data()); }); });
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

void sort_pairs(std::vector<uint32_t>& keys, std::vector<uint32_t>& values, uint32_t bits) {
    Pairs pairs{std::move(keys), std::move(values)}, scratch;
    scratch.resize(pairs.keys.size());
    std::vector<uint32_t> counts;
    sort_in_place(pairs, scratch, bits, counts);
    keys = std::move(pairs.keys);
    values = std::move(pairs.values);
}

Timed time_sort(uint32_t items, uint32_t bits, int runs) {
    if (items == 0) return {};
    Pairs input, pairs, scratch;
    input.resize(items);
    for (uint32_t i = 0; i < items; ++i) {
        input.keys[i] = core::pcg4d({i, 0x736f7274u, 0, 0})[0] >> (32 - bits);
        input.values[i] = i;
    }
    scratch.resize(items);
    std::vector<uint32_t> counts;
    Stopwatch watch;
    bool first = true;
    repeat(runs > 0 ? runs + 1 : 0, [&] {
        pairs = input;
        if (!first) watch.start();
        sort_in_place(pairs, scratch, bits, counts);
        if (!first) watch.stop();
        first = false;
    });
    return watch.timed();
}

}  // namespace ewa::bench
