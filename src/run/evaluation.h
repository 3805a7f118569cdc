// SPDX-License-Identifier: Apache-2.0
// The renders behind an evaluation.
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
    size_t at_once = 1;  // cameras of a call that draws fastest
    /// The images through the cameras, in their order.
    std::function<std::vector<Image>(std::span<const Camera>)> images;
};

/// By a renderer of these splats.
ViewRenderer view_renderer_of(std::shared_ptr<gpu::Device> device, const Gaussians& gaussians,
                              const RenderOptions& options);

/// A training or held-out image and its render, of one size.
struct RenderedView {
    Image photo, weights, rendering;  // weights: see psnr
};

/// Pairs a render with the frame's image. rendering: through the frame's camera. appearance: applied to it; null: none. Throws InputError (an image that cannot be
/// read or changed its size).
RenderedView with_photo(Image rendering, const Frame& frame, const RenderOptions& options,
                        const Appearance* appearance);

/// The appearances of views that training has not seen. learned: of the frames `train` of the dataset.
NewViewAppearance new_view_appearance(const std::vector<Appearance>& learned, const Dataset& dataset,
                                      const std::vector<int>& train);
/// The appearances of frames that training has not seen, for evaluate_views.
std::vector<Appearance> for_new_views(const NewViewAppearance& appearance, const Dataset& dataset,
                                      const std::vector<int>& frames);

/// The metrics that the options of a run ask for. Throws InputError (an unknown metric).
Measures measures_of(const RunOptions& options);

/// As ewa::evaluate. on_view: called after each view that counts, with its place in `frames`. The next view is drawn before.
/// psnr_alone: without SSIM and the figures of the meter.
Evaluation evaluate_views(const ViewRenderer& renderer, const Dataset& dataset,
                          const std::vector<int>& frames, const RenderOptions& options,
                          const std::vector<Appearance>& appearances,
                          const std::function<void()>& before_frame,
                          const std::function<void(size_t, const RenderedView&, const EvalFrame&)>& on_view,
                          const Measures& measures = {}, bool psnr_alone = false);

}  // namespace ewa::train
