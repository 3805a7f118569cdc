// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>

#include "bench/frame_run.h"
#include "bench/stability/case_errors.h"

namespace ewa::bench {
namespace {

/// 3DGS's rates for a scene of unit extent.
pipeline::Rates rates(int step) {
    pipeline::Rates r;
    r.mean = 1.6e-4f;
    r.opacity = 0.025f;
    r.quaternion = 1e-3f;
    r.scale = 5e-3f;
    r.sh0 = 2.5e-3f;
    r.sh_rest = 1.25e-4f;
    r.step = uint32_t(step);
    return r;
}

/// What was finite is finite.
bool stayed_finite(const std::vector<float>& before, const std::vector<float>& after) {
    for (size_t i = 0; i < before.size(); ++i)
        if (std::isfinite(before[i]) && !std::isfinite(after[i])) return false;
    return before.size() == after.size();
}

}  // namespace

StabilityTraining train_from(const std::shared_ptr<gpu::Device>& device, const StabilityCase& one,
                             int steps) {
    StabilityTraining result;
    result.name = one.name;
    result.steps = steps;
    // The first run moves nothing: its rates are zero.
    FrameRun run(device, {one.gaussians, one.camera, stability_photo(one.camera.width, one.camera.height)},
                 true, one.options);
    result.first_loss = pipeline::loss_of(run.counts());
    for (int step = 1; step <= steps; ++step) {
        run.set_rates(rates(step));
        run.run();
        result.last_loss = pipeline::loss_of(run.counts());
        result.finite = result.finite && std::isfinite(result.last_loss);
        result.dropped_updates += run.counts().dropped_updates;
        result.limited_steps += run.counts().limited_steps;
    }
    result.skipped = run.counts().skipped_nonfinite;
    const Gaussians end = pipeline::download_model(run.model(), run.model().params);
    const Gaussians& g = one.gaussians;
    result.finite = result.finite && stayed_finite(g.means, end.means) &&
                    stayed_finite(g.quaternions, end.quaternions) &&
                    stayed_finite(g.log_scales, end.log_scales) &&
                    stayed_finite(g.opacity_logits, end.opacity_logits) && stayed_finite(g.sh, end.sh);
    const auto planes = run.frame().planes.download<float>(run.frame().sizes.planes / 4);
    result.finite =
        result.finite && std::all_of(planes.begin(), planes.end(), [](float v) { return std::isfinite(v); });
    return result;
}

}  // namespace ewa::bench
