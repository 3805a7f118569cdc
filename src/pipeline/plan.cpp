// SPDX-License-Identifier: Apache-2.0
#include "pipeline/plan.h"

#include <algorithm>
#include <cmath>

#include "ewa/error.h"
#include "ewa/render_options.h"
#include "pipeline/model.h"
#include "scene/looks.h"
#include "shared/layouts.h"

namespace ewa::pipeline {

namespace {

void check_method(const PlanRequest& request, const scene::Method& method) {
    const auto need = [&](const scene::Lack& lack) {
        if (lack) throw InputError(std::string(method.subject).append(" ").append(lack.why));
    };
    if (method.rays) scene::check_look({.render = request.render});
    if (request.purpose == Purpose::training) need(method.no_training);
    if (request.drawing == Drawing::count || request.drawing == Drawing::ellipsoids) need(method.no_counts);
    if (request.drawing == Drawing::depth) need(method.no_depth);
    if (request.debug && request.splat_scale != 1) need(method.no_scale);
    const bool normals = request.drawing == Drawing::normal;
    if ((normals || request.drawing == Drawing::median_depth) && method.no_surface) {
        std::string why(method.no_surface.why);
        throw InputError(why.replace(why.find("{}"), 2, normals ? "normals" : "the median depth"));
    }
}

}  // namespace

uint32_t Plan::evaluated_degree(int wanted) const {
    return uint32_t(std::clamp(wanted, 0, stored_degree));
}

Plan plan_for(const PlanRequest& request) {
    const scene::Method& method = scene::method_of(request.render);
    check_method(request, method);
    Plan plan;
    plan.stored_degree = request.scene_degree;
    plan.kernel = request.render.kernel;
    // An ellipsoid of equal scales is the sphere itself.
    const bool solid = request.purpose == Purpose::image && request.drawing == Drawing::ellipsoids;
    if (!solid) plan.method = &method;
    plan.nearest = uint32_t(request.render.nearest);
    if (request.purpose == Purpose::image) {
        plan.stored_degree = std::clamp(request.render.sh_degree, 0, request.present_degree);
        plan.drawing = request.drawing;
        plan.debug = request.debug;
        plan.log_scale_shift = request.debug ? float(std::log(request.splat_scale)) : 0;
        plan.hidden_marks = request.marks & (kMarkHidden | kMarkDeleted);
        if (!request.plain_colors && !plan.surface())
            plan.tinted_marks = request.marks & (kMarkSelected | kMarkLocked | kMarkPreview);
        if (plan.reads_marks() && method.rays)
            throw InputError(std::string(method.subject) + " cannot hide or tint marked splats");
        return plan;
    }
    plan.gradients = true;
    plan.loss = request.loss;
    if (!request.alpha || method.no_alpha_gradient)
        plan.loss.alpha = 0;
    else if (plan.loss.alpha == kAutomaticAlphaWeight)
        plan.loss.alpha = kUsualAlphaWeight;
    if (!request.depths || method.no_depth_gradient) plan.loss.depth = 0;
    if (plan.loss.depth > 0) plan.drawing = Drawing::depth;
    plan.masks = request.masks;
    plan.appearance = request.appearance;
    plan.motion = request.motion && !method.no_camera_gradient;
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

FrameRequest frame_request(const Plan& plan, uint32_t width, uint32_t height) {
    return {.width = width,
            .height = height,
            .gradients = plan.gradients,
            .fifth_plane = plan.fifth_plane(),
            .masks = plan.masks,
            .appearance = plan.appearance,
            .overlaid = plan.gradients,
            .motion = plan.motion,
            .rays = plan.rays(),
            .splatting = plan.method->kind == scene::MethodKind::splat,
            .loss = plan.loss};
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
    if (!plan.pruned && plan.adam && !plan.method->no_opacity)
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
    if (plan.gradients && !plan.motion && !plan.method->no_camera_gradient)
        lines.push_back({"gradient of the camera and its passes", "not asked for (--refine-poses)", 0});
    if (plan.gradients && !plan.sky)
        lines.push_back({"sky and its passes", "not asked for (--background sky)", 0});
    if (plan.method->no_opacity) {
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
