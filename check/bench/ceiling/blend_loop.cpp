// SPDX-License-Identifier: Apache-2.0
// A blend_tile_* function. CMake compiles it again for CPUs with wider vectors, under other names and with
// fused multiply-add. All else has internal linkage, and this includes no standard header. Otherwise the
// linker could keep an inline function that was compiled for AVX-512, and run it on a CPU without.
#include "bench/ceiling/blend_loop.h"

#ifndef EWA_BENCH_BLEND_TILE  // for the oldest CPU that the program runs on; also counts the pairs
#define EWA_BENCH_BLEND_TILE blend_tile_portable
#define EWA_BENCH_LANES 8  // pixels of a vector
#define EWA_BENCH_COUNT_TILE
#endif

namespace ewa::bench {
namespace {

constexpr unsigned kLanes = EWA_BENCH_LANES;
constexpr unsigned kStripPixels = 64;
constexpr unsigned kVectors = 4;  // processed together; their state fills 16 registers
constexpr unsigned kBatch = 8;    // splats between two checks whether all pixels are saturated
typedef float Float __attribute__((vector_size(4 * EWA_BENCH_LANES)));
typedef int Int __attribute__((vector_size(4 * EWA_BENCH_LANES)));

// From shaders/shared/constants.h, as floats.
constexpr float kAlphaMax = 0.99f, kAlphaMin = 1.0f / 255.0f, kStop = 1e-4f;

/// exp(-x) for x >= 0: 2^n times Cephes' polynomial for 2^f, |f| <= 1/2 (Moshier, exp2f.c).
inline Float exp_of_negative(Float x) {
    Float t = x * -1.442695041f;
    t = t > -126.0f ? t : Float{} - 126.0f;
    const Float shifted = t + 12582912.0f;  // 1.5 * 2^23: the low bits hold t rounded
    const Float f = t - (shifted - 12582912.0f);
    Float p = f * 1.535336188e-4f + 1.339887440e-3f;
    p = p * f + 9.618437358e-3f;
    p = p * f + 5.550332471e-2f;
    p = p * f + 2.402264791e-1f;
    p = p * f + 6.931472029e-1f;
    p = p * f + 1.0f;
    return (Float)((Int)p + ((Int)shifted << 23));
}

/// kVectors * kLanes pixels of a tile, processed together.
struct Pixels {
    Float x, y;         // centres of the first vector's pixels
    float y_step;       // from one vector to the next
    Float T[kVectors];  // negative once saturated, as in the shader
    Float r[kVectors], g[kVectors], b[kVectors];
};

/// Pixels go through a strip of a tile row by row, and then through the next strip.
struct Strip {
    unsigned x0, y0, width, first;  // px; the first pixel's number in the strip
};

inline Strip strip_at(const BlendLists& lists, unsigned tile, unsigned first) {
    Strip strip;
    strip.width = kStripPixels / lists.tile_height;
    strip.x0 = tile % lists.tiles_x * lists.tile_width + first / kStripPixels * strip.width;
    strip.y0 = tile / lists.tiles_x * lists.tile_height;
    strip.first = first % kStripPixels;
    return strip;
}

inline unsigned pixels_of_tile(const BlendLists& lists) {
    return lists.tile_width * lists.tile_height;
}

inline void open_pixels(Pixels& pixels, const BlendLists& lists, const Strip& strip) {
    const unsigned rows = kLanes / strip.width;  // of one vector
    pixels.y_step = float(rows);
    for (unsigned v = 0; v < kVectors; ++v) {
        for (unsigned l = 0; l < kLanes; ++l) {
            const unsigned index = strip.first + v * kLanes + l;
            const unsigned x = strip.x0 + index % strip.width, y = strip.y0 + index / strip.width;
            pixels.T[v][l] = x < lists.width && y < lists.height ? 1.0f : -1.0f;
            if (v == 0) pixels.x[l] = float(x) + 0.5f, pixels.y[l] = float(y) + 0.5f;
        }
        pixels.r[v] = pixels.g[v] = pixels.b[v] = Float{};
    }
}

inline bool any_open(const Pixels& pixels) {
    Int open = {};
    for (unsigned v = 0; v < kVectors; ++v) open |= pixels.T[v] > 0.0f;
    int any = 0;
    for (unsigned l = 0; l < kLanes; ++l) any |= open[l];
    return any != 0;
}

template <bool kCount>
inline void blend_splat(Pixels& pixels, const float* record, Int& evaluated, Int& blended) {
    const Float dx = (pixels.x - record[0]) - record[2];
    const Float dy = (pixels.y - record[1]) - record[3];
    const float ux = record[4], skew = record[5], vy = record[6], opacity = record[7];
    const Float u0 = ux * (dx - skew * dy), v0 = vy * dy;
    const float u_step = -ux * skew * pixels.y_step, v_step = vy * pixels.y_step;
    for (unsigned i = 0; i < kVectors; ++i) {
        const Float u = u0 + u_step * float(i), v = v0 + v_step * float(i);
        Float alpha = opacity * exp_of_negative(u * u + v * v);
        alpha = alpha < kAlphaMax ? alpha : Float{} + kAlphaMax;
        alpha = alpha >= kAlphaMin ? alpha : Float{};
        const Float T = pixels.T[i], next = T - T * alpha;
        const Int keeps = next > kStop;
        const Float weight = keeps ? alpha * T : Float{};
        if (kCount) {
            evaluated -= T > 0.0f;
            blended -= weight > 0.0f;
        }
        pixels.T[i] = keeps ? next : (Float)((Int)T | int(0x80000000u));
        pixels.r[i] += weight * record[8];
        pixels.g[i] += weight * record[9];
        pixels.b[i] += weight * record[10];
    }
}

template <bool kCount>
inline void walk(Pixels& pixels, const BlendLists& lists, unsigned tile, Int& evaluated, Int& blended) {
    const unsigned end = lists.tile_starts[tile + 1];
    for (unsigned k = lists.tile_starts[tile]; k < end; k += kBatch) {
        const unsigned batch_end = end - k < kBatch ? end : k + kBatch;
        for (unsigned j = k; j < batch_end; ++j)
            blend_splat<kCount>(pixels, lists.records + 12 * (unsigned long)(lists.splats[j]), evaluated,
                                blended);
        if (!any_open(pixels)) break;
    }
}

inline void store_pixels(const Pixels& pixels, const BlendLists& lists, const Strip& strip, float* planes) {
    const unsigned long plane = (unsigned long)(lists.width) * lists.height;
    for (unsigned v = 0; v < kVectors; ++v) {
        for (unsigned l = 0; l < kLanes; ++l) {
            const unsigned index = strip.first + v * kLanes + l;
            const unsigned x = strip.x0 + index % strip.width, y = strip.y0 + index / strip.width;
            if (x >= lists.width || y >= lists.height) continue;
            const unsigned long at = (unsigned long)(y)*lists.width + x;
            const float left = pixels.T[v][l] < 0 ? -pixels.T[v][l] : pixels.T[v][l];
            planes[at] = pixels.r[v][l] + left * lists.background[0];
            planes[plane + at] = pixels.g[v][l] + left * lists.background[1];
            planes[2 * plane + at] = pixels.b[v][l] + left * lists.background[2];
            planes[3 * plane + at] = left;
        }
    }
}

}  // namespace

void EWA_BENCH_BLEND_TILE(const BlendLists& lists, std::uint32_t tile, float* planes) {
    Int unused = {};
    for (unsigned first = 0; first < pixels_of_tile(lists); first += kVectors * kLanes) {
        Pixels pixels;
        open_pixels(pixels, lists, strip_at(lists, tile, first));
        walk<false>(pixels, lists, tile, unused, unused);
        store_pixels(pixels, lists, strip_at(lists, tile, first), planes);
    }
}

#ifdef EWA_BENCH_COUNT_TILE
PairCounts count_tile(const BlendLists& lists, std::uint32_t tile) {
    PairCounts counts;
    for (unsigned first = 0; first < pixels_of_tile(lists); first += kVectors * kLanes) {
        Pixels pixels;
        Int evaluated = {}, blended = {};
        open_pixels(pixels, lists, strip_at(lists, tile, first));
        walk<true>(pixels, lists, tile, evaluated, blended);
        for (unsigned l = 0; l < kLanes; ++l) {
            counts.evaluated += std::uint64_t(evaluated[l]);
            counts.blended += std::uint64_t(blended[l]);
        }
    }
    return counts;
}
#endif

}  // namespace ewa::bench
