// SPDX-License-Identifier: Apache-2.0
#include "pipeline/plan.h"

#include <algorithm>

#include "pipeline/model.h"

namespace ewa {
namespace pipeline {

Plan plan_picture(const Gaussians& gaussians, const RenderOptions& options, bool depth) {
    Plan plan;
    plan.sh_degree = plan.stored_degree = std::min(sh_degree_present(gaussians), options.sh_degree);
    plan.kernel = options.kernel;
    plan.depth = depth;
    return plan;
}

Plan plan_gradient(const Gaussians& gaussians, const RenderOptions& options) {
    Plan plan;
    plan.stored_degree = gaussians.sh_degree;
    plan.sh_degree = std::min(gaussians.sh_degree, options.sh_degree);
    plan.kernel = options.kernel;
    plan.gradients = true;
    return plan;
}

Plan plan_training(int sh_degree, const RenderOptions& options, bool densifies) {
    Plan plan;
    plan.sh_degree = plan.stored_degree = sh_degree;
    plan.kernel = options.kernel;
    plan.gradients = plan.adam = true;
    plan.statistics = densifies;
    return plan;
}

std::vector<PlanLine> describe(const Plan& plan, int file_degree, uint64_t splats) {
    std::vector<PlanLine> lines;
    const uint32_t count = uint32_t(std::min<uint64_t>(splats, 0xffffffffu));
    const uint64_t parameters = parameter_bytes(count, plan.stored_degree);
    if (plan.stored_degree < file_degree)
        lines.push_back(
            {"SH degrees " + std::to_string(plan.stored_degree + 1) + " to " + std::to_string(file_degree),
             "every coefficient is zero, or the degree was not asked for",
             parameter_bytes(count, file_degree) - parameters});
    if (!plan.gradients)
        lines.push_back({"loss, backward passes and gradient slots", "a picture needs no gradient", 0});
    if (!plan.adam) lines.push_back({"Adam's moments", "nothing is optimised", 2 * parameters});
    if (!plan.statistics) lines.push_back({"densification statistics", "no strategy reads them", 8 * splats});
    if (!plan.depth) lines.push_back({"depth plane", "colour and opacity alone were asked for", 0});
    if (plan.gradients && !plan.masks)
        lines.push_back({"mask passes and the masked picture", "every pixel of every photograph counts", 0});
    if (plan.gradients && !plan.exposure)
        lines.push_back({"exposures, their passes and the exposed picture", "not asked for (--exposure)", 0});
    if (plan.kernel == Kernel::peak)
        lines.push_back({"footprint factor of the opacity", "the kernel is normalised to its peak", 0});
    return lines;
}

}  // namespace pipeline

std::vector<PlanLine> plan_lines(const Gaussians& gaussians, const RenderOptions& options, Purpose purpose,
                                 bool masks, bool exposure) {
    const int degree = std::min(gaussians.sh_degree, options.sh_degree);
    pipeline::Plan plan = purpose == Purpose::picture
                              ? pipeline::plan_picture(gaussians, options, false)
                              : pipeline::plan_training(degree, options, purpose == Purpose::densifying);
    plan.masks = masks;
    plan.exposure = exposure;
    return pipeline::describe(plan, gaussians.sh_degree, gaussians.size());
}

}  // namespace ewa
