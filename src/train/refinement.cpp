// SPDX-License-Identifier: Apache-2.0
#include "train/refinement.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <limits>

#include "portions/refine.h"
#include "train/state_edit.h"
#include "train/step_views.h"

namespace ewa::train {

using namespace pipeline;

namespace {

constexpr double kResetOpacity = 0.01;  // 3DGS: upper bound of opacities after a reset
double logit(double p) {
    return std::log(p / (1 - p));
}

/// origin: of the model.
Region region_of(const TrainOptions& options, const glm::dvec3& origin) {
    Region region = kEverywhere;
    if (options.region)
        for (size_t k = 0; k < region.size(); ++k)
            region[k] = float((*options.region)[k] - origin[int(k % 3)]);
    return region;
}

Ball ball_of(const CameraBall& cameras, const glm::dvec3& origin) {
    const glm::vec3 middle(cameras.middle - origin);
    return {middle.x, middle.y, middle.z, float(cameras.radius)};
}

/// The middle of the cameras, and the largest distance of one from it. Without end if a camera has parallel rays: its projection is
/// linear, whatever the size of a splat.
CameraBall ball_of(const Dataset& dataset, const std::vector<int>& frames) {
    CameraBall ball;
    for (const int f : frames)
        ball.middle += dataset.frames[size_t(f)].camera.position() / double(frames.size());
    for (const int f : frames) {
        const Camera& camera = dataset.frames[size_t(f)].camera;
        if (camera.distortion.lens == Lens::orthographic) ball.radius = double(pipeline::kFarthest);
        ball.radius = std::max(ball.radius, glm::length(camera.position() - ball.middle));
    }
    return ball;
}

}  // namespace

Refinement::Refinement(TrainingParts& parts, const Dataset& dataset, const std::vector<int>& frames)
    : parts_(parts), cameras_(ball_of(dataset, frames)) {}

void Refinement::run(const std::function<void(const Phase&)>& refine) {
    FrameTools& tools = parts_.tools;
    tools.frame.free_instances();  // the second copy of an array takes its place
    if (tools.limited) {
        // A value a splat of any portion, and no image: with mcmc one portion holds all new splats until they are level.
        tools.frame = {};
        tools.frame.reserve(*parts_.device, tools.cache.config(),
                            {.splats = parts_.portions.largest(), .width = 1, .height = 1, .instances = 1});
    }
    refine({tools.cache, tools.executor, tools.frame});
    tools.leave_room();
}

void Refinement::after(int step) {
    if (parts_.schedule.prunes(step)) return prune(step);
    if (parts_.options.strategy == Strategy::adc) control_density(step);
    if (parts_.options.strategy != Strategy::mcmc || !parts_.schedule.relocates(step)) return;
    const McmcRules rules{.dead_opacity = parts_.options.dead_opacity,
                          .growth = parts_.schedule.growth,
                          .max_splats = parts_.options.max_splats,
                          .spread = parts_.schedule.copy_spread,
                          .kernel = parts_.options.render.kernel,
                          .seed = parts_.options.seed,
                          .step = uint32_t(step),
                          .region = region_of(parts_.options, parts_.portions.origin()),
                          .frozen = parts_.frozen > 0};
    run([&](const Phase& phase) { refine_mcmc(parts_.portions, phase, rules); });
}

void Refinement::control_density(int step) {
    if (parts_.schedule.densifies(step)) {
        DensifyRules rules;
        rules.grow_gradient = float(parts_.plan.absolute ? parts_.options.grow_gradient_absolute
                                                         : parts_.options.grow_gradient);
        rules.grow_gradient *= parts_.plan.method->grow_threshold;
        rules.split = parts_.schedule.even_splits ? shared::SPLIT_EVEN : shared::SPLIT_DRAWN;
        rules.split_scale = float(parts_.options.split_scale * parts_.extent);
        rules.prune_logit = parts_.plan.method->no_opacity ? -std::numeric_limits<float>::infinity()
                                                           : float(logit(parts_.options.prune_opacity));
        rules.prune_scale =
            parts_.schedule.was_reset(step) ? float(parts_.options.prune_scale * parts_.extent) : 0.0f;
        rules.seed = parts_.options.seed;
        rules.step = uint32_t(step);
        rules.max_splats = parts_.options.max_splats;
        rules.region = region_of(parts_.options, parts_.portions.origin());
        rules.frozen = parts_.frozen > 0;
        if (parts_.schedule.bounded) rules.ball = ball_of(cameras_, parts_.portions.origin());
        run([&](const Phase& phase) { densify(parts_.portions, phase, rules); });
    }
    if (parts_.schedule.resets_opacity(step)) {
        parts_.portions.visit(portions::Portions::Need::state, [&](int, const Model& model) {
            gpu::Recording recording(parts_.device->limits());
            record_reset_opacity({recording, parts_.tools.cache}, model, float(logit(kResetOpacity)));
            parts_.tools.executor.run(recording);
            parts_.portions.changed();
        });
    }
}

/// Gives frozen splats the largest weight.
void Refinement::keep_frozen(std::vector<std::vector<float>>& weights) {
    const uint32_t planes = parameter_planes(parts_.portions.sh_degree());
    for (size_t p = 0; p < weights.size(); ++p) {
        const auto moments = parts_.portions.holder().download(int(p), portions::moments1);
        for (size_t i = 0; i < weights[p].size(); ++i)
            if (is_frozen(moments, planes, i)) weights[p][i] = std::numeric_limits<float>::infinity();
    }
}

void Refinement::prune(int step) {
    if (parts_.portions.splats() <= parts_.options.final_splats) return;
    std::vector<std::vector<float>> largest(size_t(parts_.portions.count()));
    portions::StepParts drawing = parts_.step_parts();
    drawing.submitted = [] {};
    const auto at_once = size_t(parts_.portions.ranks().size());
    for (size_t first = 0; first < parts_.images.count(); first += at_once) {
        std::vector<portions::StepView> views;
        for (size_t i = first; i < std::min(first + at_once, parts_.images.count()); ++i) {
            CameraUse camera = parts_.images.full().camera(i);
            if (parts_.plan.motion) {
                gpu::Recording recording(parts_.device->limits());
                camera = record_move_camera({recording, parts_.tools.cache}, parts_.learned.motions,
                                            uint32_t(i), camera);
                parts_.tools.executor.run(recording);
            }
            views.push_back(
                plain_view(parts_, {.camera = camera, .sh_degree = parts_.schedule.degree(step)}));
        }
        parts_.several.raise_weights(drawing, views, largest);
    }
    if (parts_.fused()) parts_.several.free_buffers();
    if (parts_.frozen > 0) keep_frozen(largest);
    const uint32_t kept = std::max(parts_.options.final_splats, parts_.frozen);
    run([&](const Phase& phase) { keep_largest(parts_.portions, phase, largest, kept); });
}

}  // namespace ewa::train
