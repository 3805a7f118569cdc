// SPDX-License-Identifier: Apache-2.0
// Error against run time of rendering: splatting and ray-marching, against the integral that both stand for
// (reference/volume.h).
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
    double milliseconds = 0;  // a frame; medians of the device's whole frame, or of the host's threads
    double rms = 0, worst = 0;
};
struct AccuracySeries {
    std::string name;
    bool line = false;  // one thing done more and more thoroughly
    std::vector<AccuracyPoint> points;
};
struct Accuracy {
    std::vector<AccuracySeries> series;
    int pixels = 0;            // at which the error is taken, evenly spread
    double exact_seconds = 0;  // that their integrals took
    unsigned threads = 0;      // of the host
};

/// say: a line for the user before each longer part.
Accuracy measure_accuracy(const std::shared_ptr<gpu::Device>& device, const Gaussians& gaussians,
                          const Camera& camera, const RenderOptions& options,
                          const std::function<void(const std::string&)>& say);

}  // namespace ewa::bench
