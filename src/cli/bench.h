// SPDX-License-Identifier: Apache-2.0
// The diagram of ewa bench --accuracy and ewa train --accuracy.
#pragma once
#include <memory>

#include "ewa/camera.h"
#include "ewa/device.h"
#include "ewa/gaussians.h"
#include "ewa/render_options.h"
#include "report/chart.h"

namespace ewa::cli {

/// Error against run time of rendering a scene through one camera. Prints progress, unless it is quiet.
report::WorkPrecision rendering_diagram(const std::shared_ptr<gpu::Device>& device,
                                        const Gaussians& gaussians, const Camera& camera,
                                        const RenderOptions& options, bool quiet);

}  // namespace ewa::cli
