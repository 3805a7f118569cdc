// SPDX-License-Identifier: Apache-2.0
// The whole chain of an image: project, sort, list, blend, then the loss and the backward pass.
#pragma once
#include "ewa/camera.h"
#include "ewa/image.h"
#include "ewa/render_options.h"
#include "reference/rendered.h"
#include "reference/values.h"

namespace ewa::reference {

/// Renders an image. With an integrator along rays, `order` and `instances` of the result are empty.
Rendered render(const Values& values, const Camera& camera, const RenderOptions& options,
                const ReferenceOptions& reference = {});

/// `target` is RGB of the camera's size. If the weight of alpha is above 0 it is RGBA, which is composited over the
/// background. Otherwise further channels are ignored.
ReferenceGradient loss_gradient(const Values& values, const Camera& camera, const Image& target,
                                const RenderOptions& options, const ReferenceOptions& reference = {});

}  // namespace ewa::reference
