// SPDX-License-Identifier: Apache-2.0
// What training learns of the appearance of its images beside the splats: PPISP or bilateral grids. backward.h has the
// third model, an affine map.
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "ewa/appearance.h"
#include "gpu/buffer.h"
#include "passes/pass.h"

namespace ewa::pipeline {

struct FrameBuffers;

/// The values of all training images and their cameras, with Adam's moments: shared/layouts.h.
struct Appearances {
    AppearanceModel model = AppearanceModel::none;
    std::vector<uint32_t> camera_of;  // of each photo; with PPISP
    uint32_t cameras = 0;
    gpu::Buffer values, moments1, moments2;
    gpu::Buffer slots;  // with PPISP: the gradient of its camera's values by each view of a step

    Appearances() = default;
    /// camera_of: of each photo, from 0 without a gap. views: of a step at most.
    Appearances(gpu::Device& device, AppearanceModel model, std::vector<uint32_t> camera_of, uint32_t views);
    uint64_t bytes() const;  // of values and of each moment
    uint32_t photo_floats() const;
    uint32_t camera_at(uint32_t camera) const;  // where its values begin, in floats
    std::vector<Appearance> download() const;
    /// Replaces the exposures in stops.
    void set_exposures(std::span<const float> stops);

    /// What a step learns of a photo, for other ranks. slot: its view in the step.
    size_t words_of_view() const;
    std::vector<uint64_t> words(uint32_t photo, uint32_t slot) const;
    void set(uint32_t photo, uint32_t slot, std::span<const uint64_t> words);
};

/// A step of one training image's appearance.
struct AppearanceUse {
    const Appearances* appearances = nullptr;
    uint32_t photo = 0;
    uint32_t slot = 0;  // of its view in the step
    float rate = 0;
    uint32_t visit = 1;  // number of this image's step, from 1
};

/// With PPISP: the cameras take their step, after those of all views of the step. photos: of the views. capacity: of
/// instances; more in frame.counts change nothing.
void record_cameras_update(const passes::Recorder& on, const Appearances& appearances,
                           const FrameBuffers& frame, std::span<const uint32_t> photos, float rate,
                           uint32_t capacity);

/// Parts into which the pixels of a column of a grid's cells are divided.
uint32_t grid_parts(uint32_t width, uint32_t height);

}  // namespace ewa::pipeline
