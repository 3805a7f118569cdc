// SPDX-License-Identifier: Apache-2.0
#include "train/schedule.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "ewa/error.h"
#include "ewa/training_needs.h"
#include "prepare/appearance_choice.h"
#include "scene/looks.h"
#include "train/exclusions.h"

namespace ewa::train {
namespace {

constexpr double kFullRun = 30000;
constexpr double kMostShortness = 300;  // rates of shorter runs than 100 steps would be out of proportion
// Lower limits of intervals, in steps.
constexpr int kLeastRefineEvery = 50;    // a small capture shows each of its images about once
constexpr int kShortRefineEvery = 20;    // of a run that cannot show each of its images before it refines
constexpr int kLeastRefinements = 6;     // of adc, unless they would last for more than two thirds of the run
constexpr int kLeastRelocateEvery = 25;  // a relocated splat has time to fade or to stay
constexpr int kLeastResetEvery = 1000;
constexpr int kLeastShEvery = 50;
// Longer runs have opacity resets, or time to recover from splits that change the picture: docs/training_options.md#even-splits.
constexpr int kLongestEvenRun = 1000;
// Longer runs are to end as before: docs/training_options.md#veils.
constexpr int kLongestBoundedRun = 1000;
// Share of the steps in which the rate of the poses rises from 0: the first splats say little of the cameras.
constexpr double kPoseWarmUp = 0.1;
// With few training images: how often each is seen by a run whose rates fade, and the rates' last factor.
constexpr int kVisitsOfFading = 60;
constexpr double kLastFading = 0.1;
// With many: the rates start higher, and settle in the last part of the run to a factor.
constexpr double kSettledPower = 1.2, kSettling = 0.2, kLastSettling = 0.2;

// PPISP and bilateral grids: steps of a full run in which their rates rise, and the rates' first and last factor.
constexpr double kPpispWarmUp = 500, kGridWarmUp = 1000, kLastAppearanceRate = 0.01;
constexpr size_t kMostPhotosOfRate = 400;
// With kAutomaticHalvings: how long the images of a run have half their sides, and the longest such run.
constexpr int kCoarseSteps = 100, kLeastCoarseRun = 10, kLongestCoarseRun = 1000;
constexpr double kMostCoarse = 0.4;   // of the steps
constexpr int kMostTileRows = 16;     // px, of any device's tiles
constexpr double kPruneShare = 0.75;  // of the steps: 0.55 gave no better images (docs/experiments/growth.md)

double decayed(double first, double last, double share) {
    const double t = std::clamp(share, 0.0, 1.0);
    return std::exp((1 - t) * std::log(first) + t * std::log(last));
}

/// The pipeline has one term of depth, whatever the depths are of.
LossWeights pipeline_loss(LossWeights loss) {
    loss.depth = loss.any_depth();
    loss.sfm_depth = 0;
    return loss;
}

}  // namespace

bool has_opacities(const TrainOptions& options) {
    return !scene::method_of(options.render).no_opacity;
}

bool thins_at_end(const TrainOptions& options) {
    if (options.final_splats != kAutomaticFinalSplats) return options.final_splats > 0;
    return options.strategy == Strategy::mcmc && options.steps < kFullRun &&
           options.max_splats == kAutomaticMaxSplats && !scene::method_of(options.render).no_weight;
}

bool few_photos(const TrainOptions& options, size_t photos) {
    return photos <= size_t(options.few_photos) && options.strategy != Strategy::mcmc &&
           has_opacities(options) && !options.refine_poses;
}

pipeline::PlanRequest plan_request(const Gaussians& start, const TrainOptions& options, bool masks,
                                   size_t photos, bool cut) {
    return {.purpose = pipeline::Purpose::training,
            .scene_degree = start.sh_degree,
            .render = options.render,
            .loss = pipeline_loss(options.loss),
            .masks = masks,
            .alpha = cut,
            .depths = true,
            .appearance = options.appearance,
            .motion = options.refine_poses,
            .sky = options.sky,
            .statistics = options.strategy == Strategy::adc,
            .absolute_gradients = options.absolute_gradients,
            .packed_moments = options.moment_bits == 16,
            .regularised = options.strategy == Strategy::mcmc || few_photos(options, photos),
            .pruned = thins_at_end(options)};
}

void check_exclusions(const TrainOptions& options, int ranks) {
    const std::array<bool, divisions> divided{ranks > 1, options.batch > 1, options.bands > 1,
                                              options.device_memory_bytes > 0};
    const scene::Method& method = scene::method_of(options.render);
    for (size_t by = 0; by < divisions; ++by)
        if (divided[by]) scene::refuse(method, method.no_division, kDivisions[by], true);
    for (const Exclusion& row : kExclusions)
        for (size_t by = 0; by < divisions; ++by)
            if (row.used(options) && divided[by] && row.excludes[by])
                throw InputError(core::excluded(kDivisions[by], row.option, row.reason));
}

void check_training(const TrainOptions& options, int ranks) {
    if (options.steps < 1) throw InputError("--steps: a training has at least one step");
    if (options.sh_degree != kAutomaticShDegree &&
        (options.sh_degree < 0 || options.sh_degree > kMaxShDegree))
        throw InputError("--sh-degree " + std::to_string(options.sh_degree) + "; it can be 0 to " +
                         std::to_string(kMaxShDegree));
    if (options.moment_bits != 16 && options.moment_bits != 32)
        throw InputError("moments of " + std::to_string(options.moment_bits) +
                         " bits; they can have 16 or 32");
    check(options.render);
    if (options.batch < 1) throw InputError("--batch: a step has at least one view");
    if (options.bands < 1) throw InputError("--bands: a view has at least one band");
    check_exclusions(options, ranks);
    scene::check_look({.render = options.render});
    scene::check_demands(kDemands, options, scene::method_of(options.render));
    core::check_exclusions(kSkyExclusions, options);
}

bool Schedule::densifies(int step) const {
    return step > refine_start && step < refine_stop && may_refine(step) &&
           (step - refine_start) % refine_every == 0;
}

bool Schedule::relocates(int step) const {
    return step > refine_start && step < relocate_stop && may_refine(step) &&
           (step - refine_start) % relocate_every == 0;
}

bool Schedule::resets_opacity(int step) const {
    return opacity_reset_every > 0 && step < refine_stop && may_refine(step) &&
           step % opacity_reset_every == 0;
}

bool Schedule::was_reset(int step) const {
    return opacity_reset_every > 0 && step > opacity_reset_every;
}

int Schedule::degree(int step) const {
    return std::min(sh_degree, std::max(least_degree, (step - 1) / sh_degree_every));
}

int Schedule::halvings_at(int step) const {
    return std::clamp(halvings - (step - 1) / resolution_every, 0, most_halvings);
}

double Schedule::gain(int step) const {
    return std::pow(shortness, power * (1 - 0.5 * double(step) / steps));
}

double Schedule::appearance_gain(int step) const {
    return std::pow(shortness, appearance_power * (1 - 0.5 * double(step) / steps));
}

double Schedule::opacity_gain(int step) const {
    return std::pow(shortness, 0.6 * power * (1 - double(step) / steps));
}

double Schedule::fading(int step) const {
    if (fade_start == 0 || step <= fade_start) return 1;
    return std::pow(last_rate, double(step - fade_start) / (steps - fade_start));
}

double Schedule::mean_rate(int step, double extent) const {
    return extent * decayed(means_rate, means_rate_final, double(step) / steps);
}

double Schedule::exposure_rate(int step) const {
    return decayed(exposures_rate, exposures_rate_final, double(step) / steps);
}

double Schedule::sky_rate(int step) const {
    return decayed(skies_rate, skies_rate_final, double(step) / steps);
}

double Schedule::appearance_rate(int step) const {
    const double share = double(step) / steps;
    const double risen = std::min(1.0, kLastAppearanceRate + share / appearance_warm_up);
    return appearances_rate * appearance_gain(step) * risen * decayed(1, kLastAppearanceRate, share);
}

double Schedule::camera_rate(int step) const {
    return appearances_rate > 0 ? appearance_rate(step) * cameras_rate / appearances_rate : 0;
}

double Schedule::pose_rate(int step) const {
    const double share = double(step) / steps;
    return decayed(poses_rate, poses_rate_final, share) * std::min(1.0, share / kPoseWarmUp);
}

uint64_t cache_share(const TrainOptions& options, int halvings) {
    const uint64_t all = options.image_cache_bytes;
    if (halvings > 0) return all >> 2 * halvings;
    uint64_t smaller = 0;
    for (int h = 1; h <= options.halvings; ++h) smaller += all >> 2 * h;
    return all - smaller;
}

namespace {

void set_rates(Schedule& s, const TrainOptions& options, size_t photos) {
    s.means_rate = options.means_rate;
    s.means_rate_final = options.means_rate_final;
    s.exposures_rate = options.exposure_rate;
    s.exposures_rate_final = options.exposure_rate_final;
    s.poses_rate = options.pose_rate;
    s.poses_rate_final = options.pose_rate_final;
    s.skies_rate = options.sky_rate;
    s.skies_rate_final = options.sky_rate_final;
    // Published rates are those of values that take a step of Adam with every image. Here they take one with their own, and
    // Adam divides a gradient that is there in one of n steps by its mean square's root, which is sqrt(n) times smaller.
    s.cameras_rate = options.appearance_rate;
    s.appearances_rate = options.appearance_rate * std::sqrt(double(std::min(photos, kMostPhotosOfRate)));
    s.appearance_warm_up =
        (options.appearance == AppearanceModel::grid ? kGridWarmUp : kPpispWarmUp) / kFullRun;
}

}  // namespace

Schedule schedule_for(const TrainOptions& options, size_t photos) {
    const double share = std::min(1.0, options.steps / kFullRun);
    const auto scaled = [&](int steps, int least) {
        return std::max(int(std::lround(steps * share)), least);
    };
    Schedule s;
    s.steps = options.steps;
    const int least_every = std::clamp(options.steps / 10, kShortRefineEvery, kLeastRefineEvery);
    s.refine_every = scaled(options.refine_every, std::min(options.refine_every, least_every));
    s.refine_start = scaled(options.refine_start,
                            std::min(options.refine_start, std::clamp(options.steps / 10, kShortRefineEvery,
                                                                      2 * kLeastRefineEvery)));
    s.refine_stop = std::max(scaled(options.refine_stop, 1),
                             std::min({s.refine_start + kLeastRefinements * s.refine_every,
                                       options.steps * 2 / 3, options.refine_stop}));
    s.relocate_stop = scaled(options.relocate_stop, 1);
    s.relocate_every = scaled(options.refine_every, std::min(options.refine_every, kLeastRelocateEvery));
    s.growth = std::pow(options.growth, std::max(1.0, s.relocate_every / (share * options.refine_every)));
    s.copy_spread = (1 - share) * options.copy_spread;
    s.even_splits = options.steps <= kLongestEvenRun && has_opacities(options);
    s.bounded = options.steps <= kLongestBoundedRun && !scene::method_of(options.render).no_footprint;
    if (options.opacity_reset_every > 0 && has_opacities(options))
        s.opacity_reset_every =
            scaled(options.opacity_reset_every, std::min(options.opacity_reset_every, kLeastResetEvery));
    if (thins_at_end(options)) s.prune_step = std::max(1, int(std::lround(kPruneShare * options.steps)));
    s.sh_degree_every = scaled(options.sh_degree_every, std::min(options.sh_degree_every, kLeastShEvery));
    s.sh_degree = options.sh_degree;
    s.halvings = options.halvings;
    s.least_degree = options.least_sh_degree;
    s.most_halvings = options.most_halvings;
    s.resolution_every = scaled(options.resolution_every, 1);
    s.shortness = std::min(1 / share, kMostShortness);
    // With higher rates the splats follow wrong cameras before these are right.
    s.power = options.refine_poses ? 0.5 * options.short_run_power : options.short_run_power;
    s.appearance_power = s.power;
    const bool few = few_photos(options, photos), shortened = options.steps < kFullRun;
    if (few && shortened && size_t(options.steps) >= photos * kVisitsOfFading) {
        s.fade_start = options.steps / 2;
        s.last_rate = kLastFading;
    }
    const bool settles =
        shortened && !few && s.power > 0 && options.strategy != Strategy::mcmc && !options.refine_poses;
    s.nesterov = settles;
    if (settles) {
        s.power *= kSettledPower;
        s.fade_start = std::max(1, int(std::lround((1 - kSettling) * options.steps)));
        s.last_rate = kLastSettling;
    }
    set_rates(s, options, photos);
    return s;
}

}  // namespace ewa::train

namespace ewa {

namespace {

/// The few splats of the beginning cannot show what an image of half the size lacks. So that they are few, the image has no fewer
/// pixels than there are points. Each band needs a row of tiles, also in the smaller image.
bool starts_coarse(const TrainOptions& options, const Dataset& dataset,
                   const std::vector<int>& train_frames) {
    if (options.steps < train::kLeastCoarseRun || options.steps > train::kLongestCoarseRun ||
        options.strategy != Strategy::adc || !train::has_opacities(options) ||
        train_frames.size() <= size_t(options.few_photos) || dataset.points.positions.empty())
        return false;
    return std::ranges::all_of(train_frames, [&](int frame) {
        const Camera& camera = dataset.frames[size_t(frame)].camera;
        const int width = camera.width / 2, height = camera.height / 2;
        return int64_t(width) * height >= int64_t(dataset.points.positions.size()) &&
               width >= train::kMostTileRows && height >= train::kMostTileRows * options.bands;
    });
}

}  // namespace

TrainOptions resolve(TrainOptions options, const Dataset& dataset, const std::vector<int>& train_frames) {
    check(dataset, train_frames);
    const bool adc_asked_for = options.absolute_gradients || !train::has_opacities(options);
    if (options.strategy == Strategy::automatic)
        options.strategy = adc_asked_for ? Strategy::adc : strategy_for(options.steps);
    if (!train::thins_at_end(options)) options.final_splats = 0;
    if (options.sh_degree == kAutomaticShDegree)
        options.sh_degree = dataset.color_depends_on_view ? kMaxShDegree : 0;
    if (options.halvings == kAutomaticHalvings) {
        options.halvings = starts_coarse(options, dataset, train_frames) ? 1 : 0;
        if (options.halvings > 0 && options.resolution_every == TrainOptions().resolution_every)
            options.resolution_every = int(
                std::min(train::kMostCoarse, double(train::kCoarseSteps) / options.steps) * train::kFullRun);
    }
    if (options.appearance == AppearanceModel::automatic)
        options.appearance = train::choose_appearance(options, dataset, train_frames).model;
    return options;
}

Strategy strategy_for(int steps) {
    constexpr int kLeastForMcmc = 5000;
    return steps >= kLeastForMcmc ? Strategy::mcmc : Strategy::adc;
}

}  // namespace ewa
