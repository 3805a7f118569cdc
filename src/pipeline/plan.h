// SPDX-License-Identifier: Apache-2.0
// What a scene and a request need: which kernels run, with which constants, and which buffers exist. A pure
// function.
#pragma once
#include <cstdint>
#include <vector>

#include "ewa/gaussians.h"
#include "ewa/render_options.h"
#include "ewa/renderer.h"

namespace ewa::pipeline {

struct Plan {
    int sh_degree = 0;      // evaluated
    int stored_degree = 0;  // kept on the device
    Kernel kernel = Kernel::peak;
    bool gradients = false;    // loss, backward passes and their buffers
    bool adam = false;         // both moments
    bool statistics = false;   // densification statistics
    bool absolute = false;     // of absolute gradients
    bool regularised = false;  // opacity and scale regularisers in the loss
    bool depth = false;
    bool count = false;         // splats blended a pixel
    bool ellipsoids = false;    // splats as solids, in place of blending
    bool inspected = false;     // scales shifted, and the splats drawn counted
    float log_scale_shift = 0;  // where inspected
    bool masks = false;         // photographs in which not every pixel counts
    bool exposure = false;      // photographs' exposures are learned
};

/// A picture: nothing of a degree the scene does not have, or that was not asked for, is stored or evaluated.
Plan plan_picture(const Gaussians& gaussians, const RenderOptions& options, bool depth);
/// A gradient: every stored coefficient gets one, so the stored degree stays.
Plan plan_gradient(const Gaussians& gaussians, const RenderOptions& options);
Plan plan_training(int sh_degree, const RenderOptions& options, bool densifies);

/// What is left out, and what that saves for `splats` splats.
std::vector<PlanLine> describe(const Plan& plan, int file_degree, uint64_t splats);

}  // namespace ewa::pipeline
