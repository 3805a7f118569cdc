// SPDX-License-Identifier: Apache-2.0
// Renders views of a scene for an evaluation, and compares them with the dataset's images.
#pragma once
#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "ewa/evaluation.h"
#include "ewa/renderer.h"
#include "ewa/run_options.h"

namespace ewa::train {

/// Renders the views of a scene.
struct ViewRenderer {
    size_t at_once = 1;  // number of cameras with which one call of `images` is fastest
    /// Renders one image through each camera, in the order of the cameras.
    std::function<std::vector<Image>(std::span<const Camera>)> images;
};

/// A ViewRenderer that draws these splats with a Renderer.
ViewRenderer view_renderer_of(std::shared_ptr<gpu::Device> device, const Gaussians& gaussians,
                              const RenderOptions& options);

/// A training or held-out image and its render, of one size.
struct RenderedView {
    Image photo, weights, rendering;  // weights: see psnr
};

/// Pairs a render with the frame's image. rendering: the render through the frame's camera. appearance: applied to the render;
/// null: none. Throws InputError (an image that cannot be read or changed its size).
RenderedView with_photo(Image rendering, const Frame& frame, const RenderOptions& options,
                        const Appearance* appearance);

/// The appearances of views that training has not seen. learned: the appearances of the dataset's frames `train`.
NewViewAppearance new_view_appearance(const std::vector<Appearance>& learned, const Dataset& dataset,
                                      const std::vector<int>& train);
/// The appearances of these frames, which training has not seen, for evaluate_views.
std::vector<Appearance> for_new_views(const NewViewAppearance& appearance, const Dataset& dataset,
                                      const std::vector<int>& frames);

/// The metrics that the options of a run ask for. Throws InputError (an unknown metric).
Measures measures_of(const RunOptions& options);

/// Evaluates as ewa::evaluate does. on_view: called with the place in `frames` after each view that counts; the next view is drawn
/// by then. psnr_alone: without SSIM and the figures of the meter.
Evaluation evaluate_views(const ViewRenderer& renderer, const Dataset& dataset,
                          const std::vector<int>& frames, const RenderOptions& options,
                          const std::vector<Appearance>& appearances,
                          const std::function<void()>& before_frame,
                          const std::function<void(size_t, const RenderedView&, const EvalFrame&)>& on_view,
                          const Measures& measures = {}, bool psnr_alone = false);

}  // namespace ewa::train
