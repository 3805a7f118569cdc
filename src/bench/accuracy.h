// SPDX-License-Identifier: Apache-2.0
// Error against run time of rendering: splatting and ray-marching, compared with the integral that both
// approximate (reference/volume.h).
#pragma once
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "ewa/camera.h"
#include "ewa/device.h"
#include "ewa/gaussians.h"
#include "ewa/render_options.h"

namespace ewa::bench {

struct AccuracyPoint {
    std::string name;
    double milliseconds = 0;  // per frame: median of the whole frame on the device, or of all host threads
    double rms = 0, worst = 0;
};
struct AccuracySeries {
    std::string name;
    bool line = false;  // one method with increasing effort
    std::vector<AccuracyPoint> points;
};
struct Accuracy {
    std::vector<AccuracySeries> series;
    int pixels = 0;            // where the error is measured, evenly spread
    double exact_seconds = 0;  // time of computing their integrals
    unsigned threads = 0;      // of the host
};

/// say: receives a line for the user before each longer part.
Accuracy measure_accuracy(const std::shared_ptr<gpu::Device>& device, const Gaussians& gaussians,
                          const Camera& camera, const RenderOptions& options,
                          const std::function<void(const std::string&)>& say);

}  // namespace ewa::bench
