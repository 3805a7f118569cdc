// SPDX-License-Identifier: Apache-2.0
// Stiff and extreme scenes: the device's error against the CPU reference, its bound, and training.
#pragma once
#include <memory>
#include <string>
#include <vector>

#include "bench/bench.h"
#include "ewa/camera.h"
#include "ewa/device.h"
#include "ewa/gaussians.h"
#include "ewa/image.h"
#include "ewa/render_options.h"

namespace ewa::bench {

struct StabilityCase {
    std::string name;  // family_value
    std::string what;  // one line: what is extreme
    Gaussians gaussians;
    Camera camera;
    RenderOptions options;
};

/// All cases in the order of their families. Equal on all machines up to the last bits of exp and log.
std::vector<StabilityCase> stability_cases();

/// A user's scene, seen from a distance at which it fills the image, with the kernel of its opacities.
StabilityCase stability_case_of(const std::string& name, const Gaussians& gaussians);

/// The target image of the loss, RGB in [0, 1]: smooth waves and noise.
Image stability_target(int width, int height);

/// Errors are relative: the largest of an image over max(1, its largest value), the norm of a gradient's
/// error over that of the reference gradient. condition: the same error of the CPU reference under a relative
/// change of each stored value, over the size of that change. Quaternions, SH and distances change
/// relatively, log-scales and logits absolutely; a few random changes estimate it. bound: docs/numerics.md.
struct Comparison {
    std::string of;
    double error = 0, bound = 0, condition = 0;
    bool good() const { return error <= bound; }  // NaN is not
};

struct StabilityResult {
    std::string name, what;
    uint32_t splats = 0, drawn = 0;                  // drawn: by the reference
    uint32_t skipped = 0, skipped_by_reference = 0;  // splats that cannot be drawn
    uint64_t pixels = 0;
    uint64_t pixels_at_threshold = 0;     // where a contribution is close to a threshold of the model
    double expected_at_threshold = 0;     // such contributions, by the areas of the footprints
    bool finite = true;                   // image, loss and gradient
    std::vector<Comparison> comparisons;  // image, loss, each group of the gradient, the camera's gradient
    double plain_determinant = 0;         // image error of the reference if det = a c - b^2 in float32
    double loss = 0;
    /// More than 4 pixels, than one in 200 and than twice those expected are excluded for being close to a threshold.
    bool too_many_at_threshold() const;
    bool good() const;
    std::string verdict() const;  // "ok", or all that is not
};

/// The device renders `drawn`, by default the splats of the case. With others, a test sees the bounds fail.
StabilityResult compare_with_reference(const std::shared_ptr<gpu::Device>& device, const StabilityCase& one,
                                       const Gaussians* drawn = nullptr);

struct StabilityTraining {
    std::string name;
    int steps = 0;
    uint32_t skipped = 0;                             // splats skipped in the last step
    uint64_t dropped_updates = 0, limited_steps = 0;  // of all steps
    bool finite = true;  // all losses, and at the end parameters and image, unless not finite at first
    double first_loss = 0, last_loss = 0;
    bool good() const { return finite; }
};

/// Integration along rays has gradients, but no training.
bool trains(const StabilityCase& one);

/// Trains with Adam at the rates of 3DGS, without densification. The case must train.
StabilityTraining train_from(const std::shared_ptr<gpu::Device>& device, const StabilityCase& one, int steps);

/// Compares and trains from each case that the options choose. Prints the table and writes the JSON. Returns
/// 1 if a bound is exceeded or a value is not finite. Throws InputError, RunError.
int run_stability(const Options& options);

}  // namespace ewa::bench
