// SPDX-License-Identifier: Apache-2.0
// The buffers of one blended image. They live as long as its record, and are then used for another image.
#pragma once
#include <cstdint>
#include <memory>
#include <vector>

#include "operators/array.h"
#include "pipeline/frame_buffers.h"

namespace ewa::operators {

/// Features are blended 4 channels at a time: a record holds that many.
inline constexpr uint32_t kGroup = 4;

struct Context;

struct BlendFrame {
    std::shared_ptr<gpu::Device> device;  // outlives the buffers below
    std::weak_ptr<Context> context;       // takes the frame back
    bool gradients = false;               // for images with gradients; then its buffers share memory

    // The image.
    uint32_t splats = 0, channels = 0, width = 0, height = 0;
    bool whiteners = false;
    bool parts = false;  // instances count in a part of their tile
    bool sharp = false;  // a footprint is sharper than the projection's low-pass allows
    std::vector<float> background;
    std::vector<uint8_t> tile_mask;
    uint32_t mask_tile_size = 16;

    pipeline::FrameBuffers frame;
    Array means{"means"}, conics{"conics"}, opacities{"opacities"}, features{"features"}, depths{"depths"},
        radii{"radii"};
    std::vector<gpu::Buffer> more_planes;  // of the second and later groups
    std::vector<float> transmittances;     // [H, W]

    // The gradient.
    Array means_gradient{"means gradient"}, conics_gradient{"conics gradient"},
        opacities_gradient{"opacities gradient"}, features_gradient{"features gradient"},
        absolute_gradient{"absolute gradient"};
    Array pixel_gradients{"pixel gradients", gpu::Texel::rgba32f};

    uint32_t groups() const { return (channels + kGroup - 1) / kGroup; }
    const gpu::Buffer& planes(uint32_t group) const {
        return group == 0 ? frame.planes : more_planes[group - 1];
    }
    bool drawn(uint32_t x, uint32_t y) const {
        if (tile_mask.empty()) return true;
        const uint32_t columns = (width + mask_tile_size - 1) / mask_tile_size;
        return tile_mask[size_t(y / mask_tile_size) * columns + x / mask_tile_size] != 0;
    }
};

}  // namespace ewa::operators
