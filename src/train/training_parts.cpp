// SPDX-License-Identifier: Apache-2.0
#include "train/training_parts.h"

#include <algorithm>
#include <utility>

#include "ewa/error.h"
#include "prepare/appearance_choice.h"
#include "scene/looks.h"
#include "scene/readout.h"

namespace ewa::train {

using namespace pipeline;

namespace {

/// The camera of each frame, from 0: frames whose files have one lens and one size share a camera. If few frames do, as
/// where each has a calibration of its own, those of one size share it.
std::vector<uint32_t> cameras_of(const Dataset& dataset, const std::vector<int>& frames) {
    constexpr size_t kPhotosPerCamera = 4;
    for (const bool lenses : {true, false}) {
        std::vector<const Frame*> seen;
        std::vector<uint32_t> cameras;
        for (const int index : frames) {
            const Frame& frame = dataset.frames[size_t(index)];
            const auto same = std::find_if(seen.begin(), seen.end(), [&](const Frame* other) {
                const Camera &a = frame.source, &b = other->source;
                return a.width == b.width && a.height == b.height &&
                       (!lenses || (a.fx == b.fx && a.fy == b.fy && a.cx == b.cx && a.cy == b.cy &&
                                    frame.distortion == other->distortion &&
                                    frame.camera.distortion == other->camera.distortion));
            });
            cameras.push_back(uint32_t(same - seen.begin()));
            if (same == seen.end()) seen.push_back(&frame);
        }
        if (!lenses || seen.size() * kPhotosPerCamera <= frames.size() || seen.size() == 1) return cameras;
    }
    return {};
}

/// Throws InputError where the training needs pinholes, and an image has another lens.
void check_lenses(const TrainOptions& options, const Dataset& dataset, const std::vector<int>& frames) {
    for (const int index : frames) {
        const Frame& frame = dataset.frames[size_t(index)];
        const bool learned = options.refine_poses && frame.camera.readout;
        if (frame.camera.distortion.none() && !scene::moves(frame.camera) && !learned) continue;
        scene::check_lens(options.render, frame.camera);
        if (learned) scene::check_readout_lens(frame.camera);
        if (options.sky && scene::moves(frame.camera))
            throw InputError("--background sky takes no rolling shutter, and frame \"" + frame.name +
                             "\" has one");
        if (options.refine_focal && frame.camera.readout)
            throw InputError("--refine-focal takes no rolling shutter, and frame \"" + frame.name +
                             "\" has one; leave it out");
        if (options.refine_focal)
            throw InputError("--refine-focal takes pinholes only, and frame \"" + frame.name +
                             "\" has another lens; take --lens undistort");
    }
}

/// Throws InputError unless each band of each image has a row of tiles. images: of the lowest resolution.
void check_bands(const TrainOptions& options, const passes::KernelConfig& config, const ImageCache& images) {
    for (size_t i = 0; i < images.count(); ++i) {
        const uint32_t height = images.camera(i).height;
        const uint32_t most = (height + config.tile_height - 1) / config.tile_height;
        if (uint32_t(options.bands) > most)
            throw InputError("--bands " + std::to_string(options.bands) + ": an image with " +
                             std::to_string(height) + " rows of pixels takes at most --bands " +
                             std::to_string(most));
    }
}

}  // namespace

std::vector<LearnedTable::Array> Learned::arrays() {
    std::vector<LearnedTable::Array> all;
    for (const auto& arrays : {appearances.arrays(), sky.arrays(), motions.arrays()})
        all.insert(all.end(), arrays.begin(), arrays.end());
    return all;
}

size_t Learned::words_of_view() const {
    return appearances.words_of_view() + sky.words_of_view();
}

std::vector<uint64_t> Learned::words(uint32_t photo, uint32_t slot) const {
    std::vector<uint64_t> words = appearances.words(photo, slot);
    const std::vector<uint64_t> of_sky = sky.words(photo, slot);
    words.insert(words.end(), of_sky.begin(), of_sky.end());
    return words;
}

void Learned::set(uint32_t photo, uint32_t slot, std::span<const uint64_t> words) {
    const size_t own = appearances.words_of_view();
    appearances.set(photo, slot, words.first(own));
    sky.set(photo, slot, words.subspan(own));
}

void StepLog::add(const portions::StepSums& sums) {
    report.loss = sums.loss;
    report.psnr = sums.psnr;
    report.skipped_nonfinite = uint32_t(sums.skipped_nonfinite);
    report.dropped_updates += sums.dropped_updates;
    report.limited_steps += sums.limited_steps;
}

void StepLog::add_passes(const std::vector<PassTime>& timings) {
    for (const PassTime& time : timings) {
        const auto same = std::find_if(times.passes.begin(), times.passes.end(),
                                       [&](const PassTime& sum) { return sum.pass == time.pass; });
        if (same == times.passes.end())
            times.passes.push_back(time);
        else
            same->milliseconds += time.milliseconds;
    }
}

StepTimes StepLog::means() const {
    StepTimes mean = times;
    mean.step /= std::max(1, times.steps);
    mean.refinement /= std::max(1, times.steps);
    mean.host /= std::max(1, host_steps);
    for (PassTime& time : mean.passes) time.milliseconds /= std::max(1, timed_steps);
    return mean;
}

TrainingParts::TrainingParts(std::shared_ptr<gpu::Device> on, const Dataset& dataset,
                             const std::vector<int>& frames, const Gaussians& ready, double extent_of_cameras,
                             const TrainOptions& resolved, std::shared_ptr<Ranks> ranks, int portions_of_rank)
    : device(std::move(on)),
      options(resolved),
      schedule(schedule_for(options, frames.size())),
      extent(extent_of_cameras),
      tools(*device, portions_of_rank > 1),
      images(*device, tools.cache.config(), dataset, frames, options, ready.origin),
      plan(plan_for(
          plan_request(ready, options, images.full().any_masked(), frames.size(), images.full().any_cut()))),
      portions(*device, std::move(ranks), ready,
               {.count = portions_of_rank,
                .limit = options.device_memory_bytes,
                .moments = plan.moment_buffers(),
                .statistics = plan.statistics}),
      several(portions, options.bands) {
    check_lenses(options, dataset, frames);
    if (options.loss.depth > 0 && !images.full().any_depths())
        throw InputError(
            "the loss has a term of depth, but no training image has a depth map; they are in depth/ beside "
            "images/, or depth_file_path names them");
    if (options.loss.sfm_depth > 0 && !images.full().any_depths())
        throw InputError(
            "the loss has a term of sfm-depth, but the dataset does not say which point an image shows; "
            "models of COLMAP do");
    check_bands(options, tools.cache.config(), images.lowest());
    if (options.final_splats > 0)
        portions::check_portions(std::min(options.final_splats, portions.splats()), portions.all());
    tools.expect(ready.size());
    if (plan.appearance != AppearanceModel::none)
        learned.appearances =
            Appearances(*device, plan.appearance, cameras_of(dataset, frames), uint32_t(options.batch));
    if (plan.appearance == AppearanceModel::ppisp && options.measure_exposures)
        learned.appearances.set_exposures(first_exposures(dataset, frames));
    if (plan.sky) learned.sky = LearnedSky(*device, uint32_t(options.batch));
    if (plan.motion) {
        std::vector<Camera> cameras;
        for (const int index : frames) cameras.push_back(dataset.frames[size_t(index)].camera);
        learned.motions = Motions(*device, motion_bases(cameras, ready, options.refine_focal, extent));
    }
    log.report.splats = portions.splats();
}

TrainingParts::~TrainingParts() {
    tools.executor.finish();  // steps in flight use buffers that go before the executor
    if (options.device_memory_bytes > 0) device->limit_memory(0, {});
}

FrameRequest TrainingParts::request_of(const CameraUse& camera) const {
    FrameRequest request = frame_request(plan, camera.width, camera.height);
    request.splats = portions.largest();
    request.instances = tools.instance_capacity;
    request.readouts = learned.motions.readouts();
    return request;
}

portions::StepParts TrainingParts::step_parts() {
    return {tools.cache,
            tools.executor,
            plan,
            tools.frame,
            tools.instance_capacity,
            [this] { log.add_passes(tools.executor.timings()); },
            learned.words_of_view()};
}

}  // namespace ewa::train
