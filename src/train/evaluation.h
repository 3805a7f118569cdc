// SPDX-License-Identifier: Apache-2.0
// The renders behind an evaluation.
#pragma once
#include <functional>
#include <memory>
#include <vector>

#include "ewa/evaluation.h"
#include "ewa/renderer.h"

namespace ewa::train {

/// A training or held-out image and its render, of one size.
struct RenderedView {
    Image photo, weights, rendering;  // weights: see psnr
};

/// exposure: applied to the render; null: none. Throws InputError (an image that cannot be read or changed its
/// size), RunError (device).
RenderedView render_view(Renderer& renderer, const Frame& frame, const RenderOptions& options,
                         const Exposure* exposure);

/// As ewa::evaluate. on_view: called after each view that counts, with its place in `frames`.
Evaluation evaluate_views(std::shared_ptr<gpu::Device> device, const Gaussians& gaussians,
                          const Dataset& dataset, const std::vector<int>& frames,
                          const RenderOptions& options, const std::vector<Exposure>& exposures,
                          const std::function<void()>& before_frame,
                          const std::function<void(size_t, const RenderedView&, const EvalFrame&)>& on_view);

}  // namespace ewa::train
