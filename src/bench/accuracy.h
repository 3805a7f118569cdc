// SPDX-License-Identifier: Apache-2.0
// Error against run time of splatting and ray-marching. Both approximate the integral in reference/volume.h.
#pragma once
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "ewa/camera.h"
#include "ewa/device.h"
#include "ewa/gaussians.h"
#include "ewa/render_options.h"
#include "report/chart.h"

namespace ewa::bench {

struct Accuracy {
    /// RMS error against ms per frame: the median of the device's whole frame, or of all host threads.
    std::vector<report::WorkSeries> series;
    int pixels = 0;            // where the error is measured, evenly spread
    double exact_seconds = 0;  // time of computing their integrals
    unsigned threads = 0;      // of the host
};

/// say: receives a line for the user before each longer part.
Accuracy measure_accuracy(const std::shared_ptr<gpu::Device>& device, const Gaussians& gaussians,
                          const Camera& camera, const RenderOptions& options,
                          const std::function<void(const std::string&)>& say);

}  // namespace ewa::bench
