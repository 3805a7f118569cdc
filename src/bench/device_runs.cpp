// SPDX-License-Identifier: Apache-2.0
#include "bench/device_runs.h"

#include <algorithm>
#include <utility>

#include "core/random.h"
#include "pipeline/camera_block.h"
#include "pipeline/photo.h"
#include "reference/blend.h"

namespace ewa::bench {
namespace {

using namespace pipeline;

RenderOptions black_background(int sh_degree) {
    RenderOptions options;
    options.sh_degree = sh_degree;
    return options;
}

}  // namespace

FrameRun::FrameRun(std::shared_ptr<gpu::Device> device, const BenchScene& scene, bool train,
                   const std::optional<RenderOptions>& options)
    : device_(std::move(device)),
      cache_(*device_),
      executor_(*device_),
      options_(options.value_or(black_background(scene.gaussians.sh_degree))),
      plan_(plan_for({.purpose = train ? Purpose::training : Purpose::picture,
                      .scene_degree = scene.gaussians.sh_degree,
                      .present_degree = sh_degree_present(scene.gaussians),
                      .render = options_})),
      model_(upload_model(*device_, scene.gaussians, train ? 2 : 0, false)),
      camera_(scene.camera),
      train_(train) {
    const shared::CameraBlock block = camera_block(camera_, cache_.config(), model_.origin);
    camera_buffer_ = gpu::Buffer(*device_, "camera", sizeof(block), gpu::Texel::none, true);
    camera_buffer_.upload(std::span<const shared::CameraBlock>(&block, 1));
    inputs_ = {.camera = {.buffer = &camera_buffer_,
                          .width = uint32_t(camera_.width),
                          .height = uint32_t(camera_.height)},
               .background = options_.background,
               .sh_degree = options_.sh_degree};
    if (train_) photo_ = upload_photo(*device_, scene.photo);
    frame_.instance_capacity = first_capacity(model_.splats);
    run();
}

void FrameRun::record(gpu::Recording& recording) {
    sorted_ = record_forward(recording, cache_, plan_, model_, frame_, inputs_);
    if (!train_) return;
    record_loss(recording, cache_, frame_, inputs_, photo_);
    record_backward(recording, cache_, plan_, model_, frame_, inputs_, sorted_, rates_);
}

void FrameRun::run() {
    counts_ = run_until_it_fits(cache_, executor_, frame_,
                                {.splats = model_.splats,
                                 .width = inputs_.camera.width,
                                 .height = inputs_.camera.height,
                                 .instances = frame_.instance_capacity,
                                 .gradients = train_},
                                [&](gpu::Recording& recording) { record(recording); });
}

gpu::Recording FrameRun::only(const gpu::Command& command) const {
    gpu::Recording alone(device_->limits());
    alone.append(command);
    return alone;
}

void FrameRun::run_apart(const std::function<void(const std::string&, const std::function<void()>&)>& each) {
    gpu::Recording whole(device_->limits());
    record(whole);
    for (const gpu::Command& command : whole.commands()) {
        const gpu::Recording alone = only(command);
        each(command.name, [&] { executor_.run(alone); });
    }
}

void FrameRun::run_update() {
    // Record the whole frame and take its last pass, so that the bindings of the pass are defined in one
    // place only.
    gpu::Recording whole(device_->limits());
    record(whole);
    executor_.run(only(whole.commands().back()), true);
}

std::vector<uint32_t> FrameRun::sorted_splats() const {
    return sorted_.splats->download<uint32_t>(counts_.instances);
}

std::vector<uint32_t> FrameRun::tile_starts() const {
    return frame_.tile_starts.download<uint32_t>(size_t(frame_.sizes.tiles) + 1);
}

std::vector<float> FrameRun::records() const {
    return frame_.records.download<float>(size_t(model_.splats) * shared::RECORD_TEXELS * 4);
}

SortRun::SortRun(std::shared_ptr<gpu::Device> device, uint32_t items)
    : device_(std::move(device)), cache_(*device_), executor_(*device_), items_(items), input_(items) {
    pipeline::FrameRequest request;
    request.splats = items;
    request.width = request.height = 8;
    const pipeline::Sizes sizes = pipeline::sizes_for(cache_.config(), request);
    cut_ = sizes.depth_sort;
    for (uint32_t i = 0; i < items; ++i) input_[i] = core::pcg4d({i, 0x736f7274u, 0, 0})[0];
    source_ = gpu::Buffer(*device_, "input", sizes.splat_words);
    source_.upload(std::span<const uint32_t>(input_));
    for (gpu::Buffer* buffer : {&keys_[0], &keys_[1], &values_[0], &values_[1]})
        *buffer = gpu::Buffer(*device_, "pairs", sizes.splat_words, gpu::Texel::rgba32ui);
    counters_ = gpu::Buffer(*device_, "counters", sizes.counters);
    counter_prefix_ = gpu::Buffer(*device_, "counter prefix", sizes.counters);
    digit_totals_ = gpu::Buffer(*device_, "digit totals", sizes.digit_totals);
    counts_ = gpu::Buffer(*device_, "counts", sizeof(shared::Counts), gpu::Texel::none, false, true);
}

void SortRun::run() {
    gpu::Recording recording(device_->limits());
    recording.copy(source_, 0, keys_[0], 0, uint64_t(items_) * 4);
    result_ =
        record_sort(recording, cache_,
                    {.keys = {&keys_[0], &keys_[1]},
                     .values = {&values_[0], &values_[1]},
                     .indices = {},
                     .own_indices = true,
                     .counters = counters_,
                     .counter_prefix = counter_prefix_,
                     .digit_totals = digit_totals_,
                     .counts = counts_},
                    {.cut = cut_, .items = items_, .capacity = items_, .keep_keys = true, .name = "sort"});
    executor_.run(recording, true);
}

Check SortRun::check() const {
    const auto expected = reference::stable_order<uint32_t>(input_);
    const auto keys = keys_[result_].download<uint32_t>(items_),
               values = values_[result_].download<uint32_t>(items_);
    uint64_t wrong = 0;
    for (uint32_t i = 0; i < items_; ++i) wrong += values[i] != expected[i] || keys[i] != input_[expected[i]];
    return {"sort: wrong entries", double(wrong), 0};
}

}  // namespace ewa::bench
