// SPDX-License-Identifier: Apache-2.0
// The learned appearances of training images: affine maps of colours, bilateral grids of such maps, or PPISP. An affine map is a
// grid of one cell.
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "ewa/appearance.h"
#include "passes/pass.h"
#include "pipeline/learned_table.h"

namespace ewa::pipeline {

struct FrameBuffers;

/// A row for each training image. With PPISP, the values of the cameras follow (shared/layouts.h), and the slot of a view has the
/// gradient with respect to its camera's values.
struct Appearances : LearnedTable {
    AppearanceModel model = AppearanceModel::none;
    std::vector<uint32_t> camera_of;  // the camera of each training image; with PPISP
    uint32_t cameras = 0;

    Appearances() = default;
    /// camera_of: the camera of each image, numbered from 0 without a gap. views: the most views of a step.
    Appearances(gpu::Device& device, AppearanceModel model, std::vector<uint32_t> camera_of, uint32_t views);
    uint32_t camera_at(uint32_t camera) const;  // index of its first value in `values`, in floats
    std::vector<Appearance> download() const;
    /// Replaces PPISP's exposures in stops.
    void set_exposures(std::span<const float> stops);
};

/// An optimisation step of one training image's appearance.
struct AppearanceUse {
    const Appearances* appearances = nullptr;
    uint32_t photo = 0;
    uint32_t slot = 0;  // number of its view in the step
    float rate = 0;
    uint32_t visit = 1;  // number of this image's step, from 1
};

/// With PPISP: updates the cameras' values after all views of a step. photos: the views' training images. capacity: of (splat,
/// tile) instances. If frame.counts exceeds it, nothing changes, because the frame is repeated.
void record_cameras_update(const passes::Recorder& on, const Appearances& appearances,
                           const FrameBuffers& frame, std::span<const uint32_t> photos, float rate,
                           uint32_t capacity);

/// Floats of a training image's row.
uint32_t row_floats(AppearanceModel model);

/// Parts into which the pixels of a column of a grid's cells are divided. 0 without a grid.
uint32_t grid_parts(AppearanceModel model, uint32_t width, uint32_t height);

}  // namespace ewa::pipeline
