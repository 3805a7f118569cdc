// SPDX-License-Identifier: Apache-2.0
// Error against run time of every way to draw splats, and the part of the error that each approximation of splatting
// has. What counts as exact is the integral in reference/volume.h, with either of its two meanings of opacity.
#pragma once
#include <memory>
#include <string>
#include <vector>

#include "bench/bench.h"
#include "ewa/camera.h"
#include "ewa/device.h"
#include "ewa/gaussians.h"
#include "ewa/render_options.h"
#include "report/work_precision.h"

namespace ewa::bench {

/// The RMS error that one approximation of splatting makes.
struct Cause {
    std::string name;
    double alone = 0;    // of the exact image with this approximation and no other
    double without = 0;  // of splatting without this approximation
};

/// What is measured against one exact image.
struct AccuracyReference {
    std::string name;      // the meaning of opacity
    double splatting = 0;  // RMS error of splatting in float64
    std::vector<Cause> causes;
};

struct Accuracy {
    /// RMS error against ms per frame: the median of the device's whole frame, or of all host threads. Each series has
    /// the error against the exact image of its kernel.
    std::vector<report::WorkSeries> series;
    std::vector<AccuracyReference> references;
    int pixels = 0;            // where the error is measured, evenly spread
    double exact_seconds = 0;  // time of computing their integrals
    unsigned threads = 0;      // of the host
};

/// Opacities are fitted to each exact image, as --kernel of ewa render does. Prints progress.
Accuracy measure_accuracy(const std::shared_ptr<gpu::Device>& device, const Gaussians& gaussians,
                          const Camera& camera, const RenderOptions& options);

/// Sets each point's verdict. "on the front": no other point of the same exact image is faster and has less error.
/// Otherwise the name of a point that is and has.
void set_verdicts(std::vector<report::WorkSeries>& series);

/// Measures the scene file of the options through its camera. Prints the tables, and writes them as JSON: `rendering` has
/// report::work_precision_json, and `styles` how each series is drawn. Returns 0. Throws InputError, RunError.
int run_accuracy(const Options& options);

}  // namespace ewa::bench
