// SPDX-License-Identifier: Apache-2.0
// A case on the device against the float64 twin: how wrong, and how wrong it may be.
#pragma once
#include <memory>
#include <string>
#include <vector>

#include "bench/stability/cases.h"
#include "ewa/device.h"

namespace ewa::bench {

/// Errors are relative: the picture's largest over max(1, its largest value), a gradient's norm over the
/// twin's. condition: the same error of the twin itself, over the relative size of a change of every stored
/// value (quaternions, SH and distance relative, logarithms of the scales and logits absolute), estimated
/// from a few random ones. bound: what docs/numerics.md says.
struct Comparison {
    std::string of;
    double error = 0, bound = 0, condition = 0;
    bool good() const { return error <= bound; }  // NaN is not
};

struct StabilityResult {
    std::string name, what;
    uint32_t splats = 0, drawn = 0;             // drawn: by the twin
    uint32_t skipped = 0, skipped_by_twin = 0;  // counted as not drawable
    uint64_t pixels = 0;
    uint64_t pixels_at_threshold = 0;     // where a contribution stands on a threshold of the model
    bool finite = true;                   // picture, loss and gradient
    std::vector<Comparison> comparisons;  // picture, loss, and each group of the gradient
    double plain_determinant = 0;         // picture of the twin with a c - b^2 in float32 for its determinant
    double loss = 0;
    /// Also: no more than one pixel in 200 is left out for standing on a threshold, or four.
    bool good() const;
};

/// The device draws `drawn`, the twin the case: other splats break the bounds.
StabilityResult compare_with_twin(const std::shared_ptr<gpu::Device>& device, const StabilityCase& one,
                                  const Gaussians& drawn);
inline StabilityResult compare_with_twin(const std::shared_ptr<gpu::Device>& device,
                                         const StabilityCase& one) {
    return compare_with_twin(device, one, one.gaussians);
}

struct StabilityTraining {
    std::string name;
    int steps = 0;
    uint32_t skipped = 0;                             // splats not drawn in the last step
    uint64_t dropped_updates = 0, limited_steps = 0;  // of all steps
    bool finite = true;  // every loss, and the parameters and picture at the end; what was not finite
                         // at the start may stay so
    double first_loss = 0, last_loss = 0;
    bool good() const { return finite; }
};

/// Adam with 3DGS's rates from such a start, without densification.
StabilityTraining train_from(const std::shared_ptr<gpu::Device>& device, const StabilityCase& one, int steps);

}  // namespace ewa::bench
