// SPDX-License-Identifier: Apache-2.0
// The error of a case on the device against the CPU reference, and its bound.
#pragma once
#include <memory>
#include <string>
#include <vector>

#include "bench/stability/cases.h"
#include "ewa/device.h"

namespace ewa::bench {

/// Errors are relative: the largest of an image over max(1, its largest value), the norm of a gradient's
/// error over that of the reference gradient. condition: the same error of the CPU reference under a relative
/// change of each stored value, over the size of that change. Quaternions, SH and distances change
/// relatively, log-scales and logits absolutely; a few random changes estimate it. bound: see
/// docs/numerics.md.
struct Comparison {
    std::string of;
    double error = 0, bound = 0, condition = 0;
    bool good() const { return error <= bound; }  // NaN is not
};

struct StabilityResult {
    std::string name, what;
    uint32_t splats = 0, drawn = 0;             // drawn: by the reference
    uint32_t skipped = 0, skipped_by_twin = 0;  // splats that cannot be drawn
    uint64_t pixels = 0;
    uint64_t pixels_at_threshold = 0;     // where a contribution is close to a threshold of the model
    bool finite = true;                   // picture, loss and gradient
    std::vector<Comparison> comparisons;  // image, loss, and each group of the gradient
    double plain_determinant = 0;         // image error of the reference if det = a c - b^2 in float32
    double loss = 0;
    /// Also requires that at most 4 pixels, or one in 200, are excluded for being close to a threshold.
    bool good() const;
};

/// The device renders `drawn`, the CPU reference the case. A test uses different splats to see the bounds
/// fail.
StabilityResult compare_with_twin(const std::shared_ptr<gpu::Device>& device, const StabilityCase& one,
                                  const Gaussians& drawn);
inline StabilityResult compare_with_twin(const std::shared_ptr<gpu::Device>& device,
                                         const StabilityCase& one) {
    return compare_with_twin(device, one, one.gaussians);
}

struct StabilityTraining {
    std::string name;
    int steps = 0;
    uint32_t skipped = 0;                             // splats skipped in the last step
    uint64_t dropped_updates = 0, limited_steps = 0;  // of all steps
    bool finite = true;  // all losses, and at the end parameters and image, unless not finite at first
    double first_loss = 0, last_loss = 0;
    bool good() const { return finite; }
};

/// Trains with Adam at the rates of 3DGS, without densification.
StabilityTraining train_from(const std::shared_ptr<gpu::Device>& device, const StabilityCase& one, int steps);

}  // namespace ewa::bench
