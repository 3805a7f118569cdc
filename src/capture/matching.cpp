// SPDX-License-Identifier: Apache-2.0
#include "capture/matching.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>

// Compiled for several kinds of processors; the fastest that runs here is taken. Whole numbers give the same results on all.
#if defined(__x86_64__) && defined(__ELF__) && !defined(__clang__) && !defined(__SANITIZE_ADDRESS__) && \
    !defined(__SANITIZE_THREAD__)
#define EWA_EVERY_PROCESSOR __attribute__((target_clones("arch=x86-64-v4", "avx2", "default")))
#else
#define EWA_EVERY_PROCESSOR
#endif

namespace ewa::capture {

// The products of four descriptors with `count` others, [4][count].
EWA_EVERY_PROCESSOR void multiply_descriptors(const std::int16_t* const* rows, const std::int16_t* others,
                                              size_t count, std::int32_t* products);

namespace {

constexpr double kMostAngle = 0.7;  // radians
constexpr double kMostRatio = 0.8;  // of the angle to the nearest by that to the second nearest
constexpr double kLength2 = 512.0 * 512.0;
constexpr int kLeastShared = 4;  // prominent features
constexpr size_t kTogether =
    4;  // rows whose products are taken in one loop, so that each descriptor is read once for all
constexpr uint32_t kNone = std::numeric_limits<uint32_t>::max();

/// The place of the largest product, if it is clearly the nearest.
uint32_t clear_nearest(const int32_t* products, size_t count) {
    int32_t best = 0, second = 0;
    uint32_t at = kNone;
    for (size_t i = 0; i < count; ++i) {
        if (products[i] <= second) continue;
        if (products[i] > best) {
            second = best;
            best = products[i];
            at = uint32_t(i);
        } else {
            second = products[i];
        }
    }
    const auto angle = [](int32_t product) { return std::acos(std::min(1.0, product / kLength2)); };
    return at != kNone && angle(best) <= kMostAngle && angle(best) < kMostRatio * angle(second) ? at : kNone;
}

/// For some of the descriptors: the place of the nearest other one, or kNone.
std::vector<uint32_t> nearest(const Descriptors& from, const std::vector<uint32_t>& places,
                              const Descriptors& others) {
    const size_t count = others.size() / kDescriptorSize;
    std::vector<int32_t> products(kTogether * count);
    std::vector<uint32_t> found(places.size(), kNone);
    for (size_t begin = 0; begin < places.size(); begin += kTogether) {
        std::array<const int16_t*, kTogether> rows{};
        for (size_t row = 0; row < kTogether; ++row)
            rows[row] = &from[places[std::min(begin + row, places.size() - 1)] * kDescriptorSize];
        multiply_descriptors(rows.data(), others.data(), count, products.data());
        for (size_t row = 0; row < std::min(kTogether, places.size() - begin); ++row)
            found[begin + row] = clear_nearest(&products[row * count], count);
    }
    return found;
}

}  // namespace

EWA_EVERY_PROCESSOR void multiply_descriptors(const std::int16_t* const* rows, const std::int16_t* others,
                                              size_t count, std::int32_t* products) {
    const std::int16_t *a = rows[0], *b = rows[1], *c = rows[2], *d = rows[3];
    for (size_t i = 0; i < count; ++i, others += kDescriptorSize) {
        std::int32_t sums[kTogether] = {};
        for (size_t k = 0; k < kDescriptorSize; ++k) {
            sums[0] += a[k] * others[k];
            sums[1] += b[k] * others[k];
            sums[2] += c[k] * others[k];
            sums[3] += d[k] * others[k];
        }
        for (size_t row = 0; row < kTogether; ++row) products[row * count + i] = sums[row];
    }
}

std::vector<FeatureMatch> matches_of(const Descriptors& first, const Descriptors& second) {
    if (first.empty() || second.empty()) return {};
    std::vector<uint32_t> all(first.size() / kDescriptorSize);
    std::iota(all.begin(), all.end(), 0u);
    const std::vector<uint32_t> there = nearest(first, all, second);
    // The way back is looked for only where something leads there.
    std::vector<uint32_t> targets;
    std::ranges::copy_if(there, std::back_inserter(targets), [](uint32_t place) { return place != kNone; });
    std::ranges::sort(targets);
    targets.erase(std::unique(targets.begin(), targets.end()), targets.end());
    const std::vector<uint32_t> back = nearest(second, targets, first);
    std::vector<FeatureMatch> matches;
    for (uint32_t i = 0; i < there.size(); ++i) {
        if (there[i] == kNone) continue;
        const auto target = std::ranges::lower_bound(targets, there[i]);
        if (back[size_t(target - targets.begin())] == i) matches.push_back({i, there[i]});
    }
    return matches;
}

std::vector<ImagePair> pairs_by_look(const std::vector<ImagePair>& candidates, const std::vector<int>& shared,
                                     int each) {
    std::vector<size_t> order(candidates.size());
    std::iota(order.begin(), order.end(), size_t(0));
    std::ranges::stable_sort(order, [&](size_t a, size_t b) { return shared[a] > shared[b]; });
    int images = 0;
    for (const ImagePair& pair : candidates) images = std::max(images, pair.second + 1);
    std::vector<int> kept(size_t(images), 0);
    std::vector<size_t> chosen;
    for (const size_t i : order) {
        if (shared[i] < kLeastShared) break;
        int& a = kept[size_t(candidates[i].first)];
        int& b = kept[size_t(candidates[i].second)];
        if (a >= each && b >= each) continue;
        chosen.push_back(i);
        ++a, ++b;
    }
    std::ranges::sort(chosen);
    std::vector<ImagePair> pairs;
    for (const size_t i : chosen) pairs.push_back(candidates[i]);
    return pairs;
}

}  // namespace ewa::capture
