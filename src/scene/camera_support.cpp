// SPDX-License-Identifier: Apache-2.0
// Which points hold a frame's camera, and which frames it shares them with.
#include <spdlog/fmt/fmt.h>

#include <algorithm>

#include "core/text.h"
#include "core/typing.h"
#include "ewa/dataset.h"

namespace ewa {

std::vector<CameraSupport> camera_support(const Dataset& dataset, size_t most) {
    const size_t count = dataset.frames.size();
    std::vector<std::vector<uint32_t>> frames_of;  // by point
    for (size_t i = 0; i < count; ++i) {
        if (!dataset.frames[i].seen) continue;
        for (const uint32_t point : *dataset.frames[i].seen) {
            if (point >= frames_of.size()) frames_of.resize(size_t(point) + 1);
            frames_of[point].push_back(uint32_t(i));
        }
    }
    if (frames_of.empty()) return {};
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
            for (const uint32_t other : frames_of[point]) ++shared[other];
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
        text += fmt::format("{} ({})", core::one_line(dataset.frames[size_t(frame)].name), points);
    }
    return text;
}

std::string support_text(const Dataset& dataset, const CameraSupport& support) {
    std::string text = core::counted(support.points, "point");
    if (support.error > 0) text += fmt::format(", {:.2f} px", support.error);
    const std::string neighbors = neighbors_text(dataset, support);
    return neighbors.empty() ? text : text + "; most in common with " + neighbors;
}

}  // namespace ewa
