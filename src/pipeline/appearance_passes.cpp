// SPDX-License-Identifier: Apache-2.0
// The passes that apply and learn the appearance of a training image.
#include <cstdint>
#include <set>
#include <span>

#include "passes/passes.h"
#include "pipeline/adam.h"
#include "pipeline/appearances.h"
#include "pipeline/frame_passes.h"
#include "shared/constants.h"

namespace ewa::pipeline {
namespace {

// Weight of the regulariser of a grid, which is divided among its cells. The loss has gradients of the order of 0.1, so this is
// too weak to matter, except where the loss is flat: all maps change one way, and the splats the other way.
constexpr float kGridPull = 1e-3f;

shared::PpispPush ppisp_push(const FrameBuffers& frame, const AppearanceUse& use) {
    const Appearances& a = *use.appearances;
    return {.image = frame.sizes.image(),
            .photo = shared::PPISP_PHOTO_FLOATS * use.photo,
            .camera = a.camera_at(a.camera_of[use.photo])};
}

bool one_cell(const Appearances& a) {
    return a.model == AppearanceModel::affine;
}

shared::GridPush grid_push(const FrameBuffers& frame, const AppearanceUse& use) {
    const bool one = one_cell(*use.appearances);
    return {.image = frame.sizes.image(),
            .photo = use.photo,
            .parts = frame.sizes.grid_parts,
            .columns = one ? 1 : shared::GRID_WIDTH * shared::GRID_HEIGHT,
            .stacks = one ? 1 : shared::GRID_DEPTH / shared::GRID_LEVELS};
}

gpu::SpecConstant grid_mode(const Appearances& a) {
    return {shared::SPEC_MODE, one_cell(a) ? shared::GRID_ONE_CELL : 0};
}

}  // namespace

void FramePasses::apply_appearance(const AppearanceUse& use) const {
    const Appearances& a = *use.appearances;
    if (a.model != AppearanceModel::ppisp)
        record(passes::GridSlice{.image = frame.planes, .grids = a.values, .exposed = frame.exposed},
               grid_push(frame, use), {grid_mode(a)});
    else
        record(passes::Ppisp{.image = frame.planes, .values = a.values, .exposed = frame.exposed},
               ppisp_push(frame, use));
}

/// Turns frame.image_gradient from dL/d(image as shown) into dL/d(image). The appearance takes a step of Adam.
void FramePasses::appearance_backward(const AppearanceUse& use) const {
    const Appearances& a = *use.appearances;
    const auto [bias1, bias2] = adam_biases(use.visit);
    if (a.model != AppearanceModel::ppisp) {
        const shared::GridPush push = grid_push(frame, use);
        const uint32_t cells = a.layout.row_floats / shared::GRID_CELL_FLOATS;
        record(passes::GridGradient{.image = frame.planes,
                                    .grids = a.values,
                                    .image_gradient = frame.image_gradient,
                                    .sums = frame.appearance_sums},
               push, {grid_mode(a)});
        record(
            passes::GridSliceBackward{
                .image = frame.planes, .grids = a.values, .image_gradient = frame.image_gradient},
            push, {grid_mode(a)});
        record(passes::GridUpdate{.sums = frame.appearance_sums,
                                  .grids = a.values,
                                  .moments1 = a.moments1,
                                  .moments2 = a.moments2,
                                  .counts = frame.counts},
               {.texels = a.layout.row_floats / 4,
                .photo = use.photo,
                .parts = push.parts,
                .rate = use.rate,
                .pull = kGridPull / float(cells),
                .bias1 = bias1,
                .bias2 = bias2,
                .instance_capacity = frame.instance_capacity});
        return;
    }
    const shared::PpispPush push = ppisp_push(frame, use);
    record(passes::PpispBackward{.image = frame.planes,
                                 .values = a.values,
                                 .image_gradient = frame.image_gradient,
                                 .sums = frame.appearance_sums},
           push);
    record(passes::PpispUpdate{.sums = frame.appearance_sums,
                               .values = a.values,
                               .moments1 = a.moments1,
                               .moments2 = a.moments2,
                               .slots = a.slots,
                               .counts = frame.counts},
           {.photo = push.photo,
            .camera = push.camera,
            .means = a.camera_at(a.cameras),
            .blocks = frame.sizes.ppisp_blocks,
            .slot = use.slot,
            .rate = use.rate,
            .bias1 = bias1,
            .bias2 = bias2,
            .instance_capacity = frame.instance_capacity});
}

void record_cameras_update(const passes::Recorder& on, const Appearances& a, const FrameBuffers& frame,
                           std::span<const uint32_t> photos, float rate, uint32_t capacity) {
    if (a.model != AppearanceModel::ppisp) return;
    std::set<uint32_t> cameras;
    for (const uint32_t photo : photos) cameras.insert(a.camera_of[photo]);
    for (const uint32_t camera : cameras)
        on.record(passes::PpispCameraUpdate{.slots = a.slots,
                                            .values = a.values,
                                            .moments1 = a.moments1,
                                            .moments2 = a.moments2,
                                            .counts = frame.counts},
                  {.camera = a.camera_at(camera),
                   .means = a.camera_at(a.cameras),
                   .photos = uint32_t(a.camera_of.size()),
                   .views = uint32_t(photos.size()),
                   .rate = rate,
                   .instance_capacity = capacity});
}

}  // namespace ewa::pipeline
