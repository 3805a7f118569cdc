// SPDX-License-Identifier: Apache-2.0
// Caches the depth images of views that are used several times.
#pragma once
#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "ewa/image.h"

namespace ewa::mesh {

/// Caches the first views up to a limit of memory, and the last requested one. Renders other views again at each request.
class DepthCache {
  public:
    DepthCache(size_t views, std::function<Image(size_t)> draw) : draw_(std::move(draw)), kept_(views) {}

    /// The reference holds until the next call.
    const Image& at(size_t view) {
        if (kept_[view]) return *kept_[view];
        if (last_view_ == view) return last_;
        Image image = draw_(view);
        const uint64_t bytes = image.pixels.size() * sizeof(float);
        if (bytes <= room_) {
            room_ -= bytes;
            return kept_[view].emplace(std::move(image));
        }
        last_ = std::move(image);
        last_view_ = view;
        return last_;
    }

  private:
    std::function<Image(size_t)> draw_;
    uint64_t room_ = uint64_t(1) << 30;
    std::vector<std::optional<Image>> kept_;
    Image last_;
    std::optional<size_t> last_view_;
};

}  // namespace ewa::mesh
