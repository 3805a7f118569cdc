// SPDX-License-Identifier: Apache-2.0
#include "pipeline/plan.h"

#include <algorithm>
#include <cmath>

#include "ewa/error.h"
#include "pipeline/model.h"
#include "scene/looks.h"
#include "shared/layouts.h"

namespace ewa::pipeline {

namespace {

void check_integrator(const PlanRequest& request) {
    const Integrator integrator = request.render.integrator;
    if (integrator == Integrator::splat) return;
    const std::string name = core::word_for(scene::kIntegratorWords, integrator);
    const auto refuse = [&](const std::string& why) {
        throw InputError("the integrator " + name + " " + why);
    };
    scene::check_look({.render = request.render});
    if (integrator == Integrator::march && request.purpose == Purpose::training)
        refuse("cannot train; the others do");
    if (request.drawing == Drawing::count || request.drawing == Drawing::ellipsoids)
        refuse("draws neither counts nor ellipsoids; splat does");
    if (integrator == Integrator::march && request.drawing == Drawing::depth)
        refuse("draws no depth; the others do");
    if (request.debug && request.splat_scale != 1)
        refuse("draws splats at their own scale; splat draws others");
    if (integrator == Integrator::march &&
        (request.render.samples < 1 || request.render.samples > kMostSamples))
        refuse("takes 1 to " + std::to_string(kMostSamples) + " samples, not " +
               std::to_string(request.render.samples));
}

void check_surface(const PlanRequest& request) {
    if (request.drawing != Drawing::median_depth && request.drawing != Drawing::normal) return;
    const std::string what = request.drawing == Drawing::normal ? "normals" : "the median depth";
    if (request.render.points) throw InputError("--points draws no surface, so " + what + " cannot be drawn");
    if (request.render.integrator != Integrator::splat)
        throw InputError("only the integrator splat draws " + what);
}

}  // namespace

uint32_t Plan::evaluated_degree(int wanted) const {
    return uint32_t(std::clamp(wanted, 0, stored_degree));
}

Plan plan_for(const PlanRequest& request) {
    check_integrator(request);
    check_surface(request);
    Plan plan;
    plan.stored_degree = request.scene_degree;
    plan.kernel = request.render.kernel;
    // An ellipsoid of equal scales is the sphere itself.
    const bool solid = request.purpose == Purpose::image && request.drawing == Drawing::ellipsoids;
    if (request.render.points && !solid) plan.nearest = uint32_t(request.render.nearest);
    plan.integrator = request.render.integrator;
    if (request.purpose == Purpose::image) {
        plan.stored_degree = std::clamp(request.render.sh_degree, 0, request.present_degree);
        plan.drawing = request.drawing;
        plan.debug = request.debug;
        plan.log_scale_shift = request.debug ? float(std::log(request.splat_scale)) : 0;
        return plan;
    }
    plan.gradients = true;
    plan.loss = request.loss;
    // Spheres and integration along rays have no gradient by the transmittance.
    if (!request.alpha || request.render.points || plan.rays())
        plan.loss.alpha = 0;
    else if (plan.loss.alpha == kAutomaticAlphaWeight)
        plan.loss.alpha = kUsualAlphaWeight;
    // The depth of spheres and along rays has no gradient.
    if (!request.depths || request.render.points || plan.rays()) plan.loss.depth = 0;
    if (plan.loss.depth > 0) plan.drawing = Drawing::depth;
    plan.masks = request.masks;
    plan.appearance = request.appearance;
    // Spheres and integration along rays have no gradient by the camera.
    plan.motion = request.motion && !request.render.points && !plan.rays();
    if (request.purpose == Purpose::training) {
        plan.adam = true;
        plan.sky = request.sky;
        plan.packed_moments = request.packed_moments;
        plan.statistics = request.statistics;
        plan.absolute = request.statistics && request.absolute_gradients;
        plan.regularised = request.regularised;
        plan.pruned = request.pruned;
    }
    return plan;
}

std::vector<PlanLine> describe(const Plan& plan, int scene_degree, uint64_t splats) {
    std::vector<PlanLine> lines;
    const uint32_t count = uint32_t(std::min<uint64_t>(splats, 0xffffffffu));
    const uint64_t parameters = parameter_bytes(count, plan.stored_degree);
    if (plan.stored_degree < scene_degree)
        lines.push_back(
            {"SH degrees " + std::to_string(plan.stored_degree + 1) + " to " + std::to_string(scene_degree),
             "every coefficient is zero, or the degree was not asked for",
             parameter_bytes(count, scene_degree) - parameters});
    if (!plan.gradients)
        lines.push_back({"loss, backward passes and gradient slots", "a picture needs no gradient", 0});
    if (!plan.adam) lines.push_back({"Adam's moments", "nothing is optimised", parameters});
    if (plan.packed_moments)
        lines.push_back({"half of the bits of Adam's moments", "16 bits are enough (--moments)", parameters});
    if (!plan.statistics) lines.push_back({"densification statistics", "no strategy reads them", 8 * splats});
    if (!plan.absolute && plan.statistics)
        lines.push_back({"sums of absolute gradients", "not asked for (--absgrad)", 0});
    if (!plan.regularised && plan.adam)
        lines.push_back({"opacity and scale regularisers", "the strategy has none", 0});
    if (!plan.pruned && plan.adam && !plan.points())
        lines.push_back({"largest weights of splats in the training images",
                         "all splats stay (--final-splats)", sizeof(float) * splats});
    if (plan.drawing != Drawing::depth)
        lines.push_back({"depth plane", "only colour and opacity were asked for", 0});
    if (plan.gradients && plan.loss.ssim == 0)
        lines.push_back({"SSIM passes and their moments", "its weight is 0 (--loss)", 0});
    if (plan.gradients && plan.loss.l2 == 0)
        lines.push_back({"squared differences in the loss", "their weight is 0 (--loss)", 0});
    if (plan.gradients && plan.loss.alpha == 0)
        lines.push_back({"alpha in the loss and its gradient", "no training image is cut out", 0});
    if (plan.gradients && !plan.masks)
        lines.push_back(
            {"mask passes and the masked image", "every pixel of every training image counts", 0});
    if (plan.gradients && plan.appearance == AppearanceModel::none)
        lines.push_back(
            {"appearance of images, its passes and the image as shown", "not asked for (--appearance)", 0});
    if (plan.gradients && !plan.motion && !plan.points() && !plan.rays())
        lines.push_back({"gradient of the camera and its passes", "not asked for (--refine-poses)", 0});
    if (plan.gradients && !plan.sky)
        lines.push_back({"sky and its passes", "not asked for (--background sky)", 0});
    if (plan.points()) {
        lines.push_back({"opacities and rotations", "a sphere has none (--points)", 0});
        return lines;
    }
    if (!plan.rays())
        lines.push_back({"how rays meet splats, and their order along each ray",
                         "not asked for (--integrator)", shared::RAY_TEXELS * 16 * splats});
    if (plan.kernel == Footprint::peak)
        lines.push_back({"footprint factor of the opacity", "the kernel is normalised to its peak", 0});
    return lines;
}

}  // namespace ewa::pipeline
