// SPDX-License-Identifier: Apache-2.0
// The passes of a frame: from parameters to image planes, to the loss, and to updated parameters or their gradient. FramePasses
// alone has their order.
#pragma once
#include <array>

#include "pipeline/frame_buffers.h"
#include "pipeline/frame_inputs.h"
#include "pipeline/model.h"
#include "pipeline/plan.h"

namespace ewa::pipeline {

struct AppearanceUse;
struct LearnedSky;
struct ListStart;
struct MotionUse;
struct Rates;
struct ViewBuffers;

/// Which of the ping-pong buffers hold the sorted instances after the forward frame.
struct Sorted {
    const gpu::Buffer* splats = nullptr;   // each instance's splat, in the order of Sizes::slot_order
    const gpu::Buffer* indices = nullptr;  // with gradients: see SLOTS_SORTED and SLOTS_EMITTED
};

/// Depths that the loss compares with the render's.
struct DepthUse {
    const gpu::Buffer* map = nullptr;  // width * height floats, 0 where there is no depth; null: none
    uint64_t pixels = 0;               // number of pixels in the mean; 0: all
};

/// Records the passes of a frame.
struct FramePasses : passes::Recorder {
    const Plan& plan;
    const FrameBuffers& frame;
    const FrameInputs& inputs;

    /// Records what differs from step to step of a training: copies the camera to frame.step_camera, clears the counts, unpacks the
    /// photo, and writes the values of the update. The passes of a frame with inputs.prepared, whose camera is frame.step_camera,
    /// are then the same commands in each step. photo: without a mask or a cut.
    void prepare(const Model& model, const gpu::Buffer& photo, const Rates& rates) const;
    /// Project, depth order, instances, tile order, tile starts, blend. `frame` must be reserved for the
    /// model's splats and the camera's size. After the submission, Counts.instances is the number of instances
    /// needed. If that exceeds frame.instance_capacity, the image is empty: repeat the frame with more capacity.
    Sorted forward(const Model& model) const;
    /// The first part of forward: clears the counts and projects the model's splats.
    void project(const Model& model) const;
    /// The second part of forward, after project: from the frame's records, depth_keys[0] and tile_counts of `splats` splats to
    /// image planes.
    Sorted draw(uint32_t splats) const;

    /// After drawing: raises each value of `largest` to the splat's largest blending weight at a pixel. Values are the bits of
    /// floats.
    void contributions(const Sorted& sorted, const gpu::Buffer& largest) const;

    /// Computes the loss terms into Counts, and dL/d(image) into frame.image_gradient. Losses and gradients of a view's bands add
    /// up to those of the whole view. photo: width * height texels, RGBA. Its alpha composites it over the background or, if
    /// `masked`, is the weight of each pixel; `frame` must then be reserved with masks. appearance: of the training image, if it is
    /// learned. The pass also does Adam's step of the appearance; `frame` must be reserved with its model. cut: the photo is
    /// composited, and its alpha is compared with the render's if the loss has that term. depths: of the photo, if the loss has
    /// that term.
    void loss(const gpu::Buffer& photo, bool masked = false, const AppearanceUse* appearance = nullptr,
              bool cut = false, const DepthUse& depths = {}) const;

    /// After the loss: writes the gradient with respect to the sky into the view's slot. slot: number of the view in the step.
    void sky_gradient(const LearnedSky& sky, uint32_t slot) const;

    /// Computes the gradients of blending and projection. With plan.adam, updates the model; without, writes the gradient to
    /// model.moments1. With plan.motion, the gradient of the camera's motion is in frame.motion_reduced, which must be reserved for
    /// it. motion: of the training image's camera, if motions are learned. Also does Adam's step of this motion.
    void backward(const Model& model, const Sorted& sorted, const Rates& rates,
                  const MotionUse* motion = nullptr) const;

    // A step of several views: see views.h.

    /// Projects the model's splats for a view and lists those that reach a tile of inputs.band. After the submission
    /// Counts.scan_total is their number. `frame` must be reserved for the model's splats. projected: `frame` still has the
    /// projection that another band of the same view has made.
    void list(const Model& model, const ViewBuffers& buffers, const ListStart& start,
              bool projected = false) const;
    /// A forward frame of a list of `splats` splats, whose records are in frame.records. As after forward, repeat it if
    /// Counts.instances exceeds the capacity.
    Sorted draw_list(uint32_t splats) const;
    /// After the loss: computes the gradients of blending a list, and writes each splat's sums into `sums`, from first_index on.
    void list_backward(uint32_t splats, const Sorted& sorted, const gpu::Buffer& sums,
                       uint32_t first_index) const;
    /// Updates the model by the mean gradient of the views. rates: of one view; batch_rates turns them into those of the step.
    /// bands: number of lists of each view; a band's list is `view * bands + band`. It reads only two of the inputs: the SH degree
    /// and the cameras' lenses.
    void update_views(const Model& model, const ViewBuffers& buffers, const Rates& rates,
                      uint32_t bands = 1) const;

    // Bindings and constants for the passes of a method of drawing: see methods.h.

    gpu::BufferPart camera() const;
    gpu::SpecConstant degree() const;
    gpu::SpecConstant lenses() const { return {shared::SPEC_LENSES, inputs.camera.lenses}; }
    gpu::SpecConstant wrap() const { return {shared::SPEC_WRAP, inputs.camera.wraps ? 1u : 0u}; }
    gpu::SpecConstant quads() const { return {shared::SPEC_QUADS, frame.sizes.quads}; }
    gpu::SpecConstant slots() const { return {shared::SPEC_SLOTS, frame.sizes.slot_order}; }
    gpu::SpecConstant kernel() const { return {shared::SPEC_KERNEL, uint32_t(plan.kernel)}; }

    /// Records a pass that has one subgroup a tile, or four a quad.
    template <class Definition>
    void record_tiles(const Definition& buffers, const shared::BlendPush& push,
                      passes::Constants variant) const {
        variant.insert(variant.end(), {wrap(), slots(), quads()});
        if (frame.sizes.quads > 0) return record(passes::OfQuads<Definition>{buffers}, push, variant);
        record(buffers, push, variant);
    }

  private:
    void clear_counts() const;
    void unpack(const gpu::Buffer& photo) const;
    void write_values(const Model& model, const Rates& rates) const;
    void add_sky() const;
    void compare(const gpu::Buffer& image, const shared::LossPush& push, float share) const;
    void compare_alpha(const gpu::Buffer& photo, bool cut, const shared::MaskPush& at,
                       const shared::LossPush& loss) const;
    void compare_depth(const DepthUse& depths, const shared::MaskPush& at,
                       const shared::LossPush& loss) const;
    void mean_of_partials(uint32_t target, uint32_t items, uint32_t rows, float scale) const;
    void apply_appearance(const AppearanceUse& use) const;
    void appearance_backward(const AppearanceUse& use) const;
    void blend_backward(const Sorted& sorted) const;
};

/// The part between projection and blending: depth order, instances, tile order, tile starts. It reads frame's records,
/// depth_keys[0] and tile_counts, and leaves each tile's splats in instance_splats[1] and tile_starts; with gradients also
/// sorted_indices[1] and first_instances. Sizes::slot_order says what is in which order.
/// wraps: as in CameraUse.
void record_tile_lists(const passes::Recorder& on, bool gradients, uint32_t splats, const FrameBuffers& frame,
                       bool wraps = false);

shared::BlendPush blend_push(const passes::KernelConfig& config, const FrameBuffers& frame,
                             const std::array<float, 3>& background);

}  // namespace ewa::pipeline
