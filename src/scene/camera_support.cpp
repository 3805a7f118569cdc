// SPDX-License-Identifier: Apache-2.0
// Which points hold a frame's camera, and which frames it shares them with.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <vector>

#include "core/text.h"
#include "core/typing.h"
#include "ewa/dataset.h"

namespace ewa {

namespace {

/// The frames that see each point: those of point i are frames[first[i]] to frames[first[i + 1] - 1]. Two arrays for all points: there
/// may be ten millions.
struct Sightings {
    std::vector<uint64_t> first;
    std::vector<uint32_t> frames;
};

Sightings sightings_of(const Dataset& dataset) {
    Sightings sightings;
    auto& [first, frames] = sightings;
    for (const Frame& frame : dataset.frames) {
        if (!frame.seen) continue;
        for (const uint32_t point : *frame.seen) {
            if (first.size() < size_t(point) + 2) first.resize(size_t(point) + 2);
            ++first[size_t(point) + 1];
        }
    }
    for (size_t i = 1; i < first.size(); ++i) first[i] += first[i - 1];
    if (first.empty()) return sightings;
    frames.resize(first.back());
    std::vector<uint64_t> next = first;
    for (size_t i = 0; i < dataset.frames.size(); ++i)
        if (dataset.frames[i].seen)
            for (const uint32_t point : *dataset.frames[i].seen) frames[next[point]++] = uint32_t(i);
    return sightings;
}

}  // namespace

std::vector<CameraSupport> camera_support(const Dataset& dataset, size_t most) {
    const size_t count = dataset.frames.size();
    const Sightings sightings = sightings_of(dataset);
    if (sightings.frames.empty()) return {};
    std::vector<CameraSupport> supports(count);
    std::vector<size_t> shared(count);
    for (size_t i = 0; i < count; ++i) {
        const Frame& frame = dataset.frames[i];
        if (!frame.seen) continue;
        CameraSupport& support = supports[i];
        support.points = frame.seen->size();
        support.error = frame.point_error;
        std::ranges::fill(shared, size_t(0));
        for (const uint32_t point : *frame.seen)
            for (uint64_t k = sightings.first[point]; k < sightings.first[size_t(point) + 1]; ++k)
                ++shared[sightings.frames[k]];
        for (size_t other = 0; other < count; ++other)
            if (other != i && shared[other] > 0) support.neighbors.push_back({int(other), shared[other]});
        std::ranges::stable_sort(support.neighbors, std::greater<>(), &CameraSupport::Neighbor::points);
        support.neighbors.resize(std::min(most, support.neighbors.size()));
    }
    return supports;
}

std::string neighbors_text(const Dataset& dataset, const CameraSupport& support) {
    std::string text;
    for (size_t k = 0; k < support.neighbors.size(); ++k) {
        const auto& [frame, points] = support.neighbors[k];
        if (k > 0) text += k + 1 == support.neighbors.size() ? " and " : ", ";
        text += core::one_line(dataset.frames[size_t(frame)].name) + " (" + std::to_string(points) + ")";
    }
    return text;
}

std::string support_text(const Dataset& dataset, const CameraSupport& support) {
    std::string text = core::counted(support.points, "point");
    if (support.error > 0) text += ", " + core::shown_number(std::round(100 * support.error) / 100) + " px";
    const std::string neighbors = neighbors_text(dataset, support);
    return neighbors.empty() ? text : text + "; most in common with " + neighbors;
}

}  // namespace ewa
