// SPDX-License-Identifier: Apache-2.0
#include "bench/device_runs.h"

#include <bit>
#include <span>
#include <utility>

#include "core/random.h"
#include "ewa/renderer.h"
#include "pipeline/frame_inputs.h"
#include "reference/render.h"
#include "reference/training.h"
#include "shared/constants.h"

namespace ewa::bench {

using namespace pipeline;

FrameRun::FrameRun(std::shared_ptr<gpu::Device> device, const BenchScene& scene, bool train,
                   const std::optional<RenderOptions>& options,
                   const std::optional<passes::KernelConfig>& config, int moment_bits)
    : device_(std::move(device)),
      cache_(*device_, config.value_or(passes::config_for(device_->limits()))),
      executor_(*device_),
      options_(options.value_or(RenderOptions{.sh_degree = scene.gaussians.sh_degree})),
      plan_(plan_for({.purpose = train ? Purpose::training : Purpose::image,
                      .scene_degree = scene.gaussians.sh_degree,
                      .present_degree = sh_degree_present(scene.gaussians),
                      .render = options_,
                      .packed_moments = moment_bits == 16})),
      model_(upload_model(*device_, scene.gaussians, plan_.moment_buffers(), false)),
      camera_(scene.camera),
      train_(train) {
    camera_buffer_ = upload_camera(*device_, camera_, cache_.config(), model_.origin);
    inputs_ = inputs_of(camera_buffer_, camera_, options_);
    if (train_) image_ = upload_photo(*device_, scene.image);
    frame_.instance_capacity = first_capacity(model_.splats);
    run();
}

void FrameRun::record(const passes::Recorder& recorder) {
    const FramePasses on{recorder, plan_, frame_, inputs_};
    sorted_ = on.forward(model_);
    if (!train_) return;
    on.loss(image_);
    on.backward(model_, sorted_, rates_);
}

void FrameRun::run() {
    FrameRequest size = frame_request(plan_, inputs_.camera.width, inputs_.camera.height);
    size.splats = model_.splats;
    size.instances = frame_.instance_capacity;
    counts_ =
        run_until_it_fits(cache_, executor_, frame_, size, [&](const passes::Recorder& on) { record(on); });
}

void FrameRun::run_forward() {
    gpu::Recording recording(device_->limits());
    sorted_ = FramePasses{{recording, cache_}, plan_, frame_, inputs_}.forward(model_);
    executor_.run(recording);
}

gpu::Recording FrameRun::only(const gpu::Command& command) const {
    gpu::Recording alone(device_->limits());
    alone.append(command);
    return alone;
}

void FrameRun::run_apart(const std::function<void(const std::string&, const std::function<void()>&)>& each) {
    gpu::Recording whole(device_->limits());
    record({whole, cache_});
    for (const gpu::Command& command : whole.commands()) {
        const gpu::Recording alone = only(command);
        each(command.name, [&] { executor_.run(alone); });
    }
}

void FrameRun::run_update() {
    // Takes the last pass of a whole frame, so that only one place defines the bindings of the pass.
    gpu::Recording whole(device_->limits());
    record({whole, cache_});
    executor_.run(only(whole.commands().back()), true);
}

std::vector<uint32_t> FrameRun::sorted_splats() const {
    std::vector<uint32_t> splats = sorted_.splats->download<uint32_t>(counts_.instances);
    if (frame_.sizes.quads > 0)
        for (uint32_t& splat : splats) splat &= (1u << shared::PART_SHIFT) - 1;
    if (!frame_.slots_emitted()) return splats;
    std::vector<uint32_t> sorted = sorted_.indices->download<uint32_t>(counts_.instances);
    for (uint32_t& index : sorted) index = index < splats.size() ? splats[index] : ~0u;
    return sorted;
}

std::vector<uint32_t> FrameRun::tile_starts() const {
    return frame_.tile_starts.download<uint32_t>(size_t(frame_.sizes.tiles) + 1);
}

std::vector<float> FrameRun::records() const {
    return frame_.records.download<float>(size_t(model_.splats) * shared::RECORD_TEXELS * 4);
}

SortRun::SortRun(std::shared_ptr<gpu::Device> device, uint32_t items, const passes::KernelConfig& config)
    : device_(std::move(device)),
      cache_(*device_, config),
      executor_(*device_),
      items_(items),
      input_(items) {
    passes::KernelConfig sorting = cache_.config();
    sorting.sorted_lists = 0;
    const Sizes sizes = sizes_for(sorting, {.splats = items, .width = 8, .height = 8});
    cut_ = sizes.depth_sort;
    for (uint32_t i = 0; i < items; ++i) input_[i] = core::pcg4d({i, 0x736f7274u, 0, 0})[0];
    source_ = gpu::Buffer(*device_, "input", sizes.splat_words);
    source_.upload(std::span<const uint32_t>(input_));
    for (gpu::Buffer* buffer : {&keys_[0], &keys_[1], &values_[0], &values_[1]})
        *buffer = gpu::Buffer(*device_, "pairs", sizes.splat_words, gpu::Texel::rgba32ui);
    counters_ = gpu::Buffer(*device_, "counters", sizes.counters);
    counter_prefix_ = gpu::Buffer(*device_, "counter prefix", sizes.counters);
    digit_totals_ = gpu::Buffer(*device_, "digit totals", sizes.digit_totals);
    counts_ = gpu::Buffer(*device_, "counts", sizeof(shared::Counts));
}

void SortRun::run() {
    gpu::Recording recording(device_->limits());
    recording.copy(source_, 0, keys_[0], 0, uint64_t(items_) * 4);
    result_ =
        record_sort({recording, cache_},
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

namespace {

/// The buffers between projection and blending, on the host.
struct Lists {
    std::vector<float> records;
    std::vector<uint32_t> tile_counts, order, prefix, totals;  // one per splat; totals: one per block
    bool sorted_lists = false;  // emitted in the order of the splats; `order` is then the reference's
    std::vector<uint32_t> keys, indices, splats, tile_starts;  // one per instance; tile_starts: one per tile
    uint32_t scan_block = 1, tiles = 0, instances = 0;
};

/// A sort in several passes leaves the sorted keys. That in one pass, and sorted lists, leave the keys as emitted.
std::vector<uint32_t> sorted_keys(const FrameBuffers& frame, uint32_t instances) {
    const bool emitted = frame.sizes.sorted_lists || frame.sizes.tile_sort.passes == 1;
    std::vector<uint32_t> keys = frame.instance_keys[emitted ? 0 : 1].download<uint32_t>(instances);
    if (emitted) std::ranges::sort(keys);
    return keys;
}

std::vector<uint32_t> depth_order(const Lists& lists) {
    std::vector<uint32_t> keys(lists.tile_counts.size());
    for (size_t i = 0; i < keys.size(); ++i)
        keys[i] =
            lists.tile_counts[i] > 0 ? std::bit_cast<uint32_t>(lists.records[12 * i + 11]) : 0xffffffffu;
    const auto order = reference::stable_order<uint32_t>(keys);
    return {order.begin(), order.end()};
}

Lists download(FrameRun& run) {
    run.run_forward();
    const FrameBuffers& frame = run.frame();
    const Sizes& sizes = frame.sizes;
    const size_t n = run.model().splats;
    Lists lists;
    lists.records = run.records();
    lists.tile_counts = frame.tile_counts.download<uint32_t>(n);
    lists.sorted_lists = sizes.sorted_lists;
    lists.order = sizes.sorted_lists ? depth_order(lists) : frame.order[0].download<uint32_t>(n);
    lists.prefix = frame.prefix.download<uint32_t>(n);
    lists.totals = frame.scan_totals.download<uint32_t>(size_t(sizes.scan_blocks) + 1);
    lists.instances = run.counts().instances;
    if (run.plan().gradients) lists.indices = run.sorted().indices->download<uint32_t>(lists.instances);
    lists.keys = sorted_keys(frame, lists.instances);
    lists.splats = run.sorted_splats();
    lists.tile_starts = run.tile_starts();
    lists.scan_block = sizes.scan_block;
    lists.tiles = sizes.tiles;
    return lists;
}

Check wrong_entries(const char* what, uint64_t wrong) {
    return {what, double(wrong), 0};
}

Check check_depth_order(const Lists& lists) {
    const auto expected = depth_order(lists);
    uint64_t wrong = 0;
    for (size_t i = 0; i < expected.size(); ++i) wrong += lists.order[i] != expected[i];
    return wrong_entries("depth order: wrong entries", wrong);
}

Check check_scan(const Lists& lists) {
    std::vector<uint32_t> counts(lists.order.size());
    for (size_t rank = 0; rank < counts.size(); ++rank) {
        const size_t splat = lists.sorted_lists ? rank : lists.order[rank];
        counts[rank] = splat < counts.size() ? lists.tile_counts[splat] : 0;
    }
    const auto expected = reference::exclusive_scan(counts);
    uint64_t wrong = expected.back() != lists.instances;
    for (size_t rank = 0; rank < counts.size(); ++rank)
        wrong += lists.totals[rank / lists.scan_block] + lists.prefix[rank] != expected[rank];
    return wrong_entries("instance offsets: wrong entries", wrong);
}

/// Tiles ascend; within a tile instances are in depth order; every splat is there as often as it was counted; with gradients, no
/// two instances share a place.
Check check_tile_order(const Lists& lists) {
    const size_t n = lists.tile_counts.size();
    std::vector<uint32_t> rank(n), times(n);
    for (uint32_t r = 0; r < n; ++r)
        if (lists.order[r] < n) rank[lists.order[r]] = r;
    uint64_t wrong = 0;
    for (size_t k = 0; k < lists.instances; ++k) {
        if (lists.splats[k] >= n) {
            ++wrong;
            continue;
        }
        ++times[lists.splats[k]];
        if (k == 0 || lists.splats[k - 1] >= n) continue;
        const bool later = rank[lists.splats[k - 1]] < rank[lists.splats[k]];
        wrong += lists.keys[k - 1] > lists.keys[k] || (lists.keys[k - 1] == lists.keys[k] && !later);
    }
    for (size_t i = 0; i < n; ++i) wrong += times[i] != lists.tile_counts[i];
    std::vector<uint32_t> taken(lists.indices.size());
    for (const uint32_t index : lists.indices) wrong += index >= taken.size() || ++taken[index] != 1;
    return wrong_entries("tile order: wrong entries", wrong);
}

Check check_tile_starts(const Lists& lists) {
    uint64_t wrong = 0;
    for (uint32_t tile = 0; tile <= lists.tiles; ++tile) {
        const auto first = std::lower_bound(lists.keys.begin(), lists.keys.end(), tile);
        wrong += lists.tile_starts[tile] != uint32_t(first - lists.keys.begin());
    }
    return wrong_entries("tile starts: wrong entries", wrong);
}

double relative(double actual, double expected) {
    const double error = std::abs(actual - expected) / std::max(std::abs(expected), 1e-30);
    return std::isfinite(error) ? error : INFINITY;
}

std::vector<Check> check_project(const Lists& lists, const FrameRun& run, const BenchScene& scene) {
    double mean = 0, shape = 0, color = 0;
    uint64_t unseen = 0;
    for (size_t i = 0; i < lists.tile_counts.size(); ++i) {
        if (lists.tile_counts[i] == 0) continue;
        const auto expected = reference::project(scene.gaussians, i, scene.camera, run.options());
        if (!expected.visible) {
            ++unseen;
            continue;
        }
        const float* record = &lists.records[12 * i];
        const auto w = reference::whitener(expected);
        const double half = std::sqrt(0.5);  // the device's u and v include the 1/2 of the exponent
        mean = std::max({mean, std::abs(double(record[0]) + record[2] - expected.mean2d.x),
                         std::abs(double(record[1]) + record[3] - expected.mean2d.y)});
        shape = std::max({shape, relative(record[4], half * w.ux), relative(record[6], half * w.vy),
                          relative(record[7], expected.opacity), relative(record[11], expected.z)});
        for (int c = 0; c < 3; ++c) color = std::max(color, std::abs(record[8 + c] - expected.color[c]));
    }
    return {wrong_entries("project: visible splats that the reference skips", unseen),
            {"project: mean, px", mean, 1e-3},
            {"project: shape, opacity and depth, relative", shape, 1e-4},
            {"project: colour", color, 1e-5}};
}

constexpr double kPixelBound = 1e-5;     // of most pixels
constexpr double kPixelShare = 1e-3;     // share of pixels that may exceed it
constexpr double kGradientBound = 1e-3;  // |actual - expected| / |expected|
constexpr double kAdamBound = 1e-3;      // in learning rates

/// Wrong entries in depth order, scan, instances, tile order and tile starts; errors of the records.
std::vector<Check> check_lists(FrameRun& run, const BenchScene& scene) {
    const Lists lists = download(run);
    std::vector<Check> checks = check_project(lists, run, scene);
    if (!lists.sorted_lists) checks.push_back(check_depth_order(lists));
    checks.push_back(check_scan(lists));
    checks.push_back(check_tile_order(lists));
    checks.push_back(check_tile_starts(lists));
    return checks;
}

/// In float32, a contribution at the 1/255 threshold may be skipped or not. Therefore one bound limits the
/// share of deviating pixels, and another the worst pixel.
std::vector<Check> check_picture(const FrameRun& run, const BenchScene& scene) {
    const auto expected = reference::render(scene.gaussians, scene.camera, run.options());
    const Sizes& sizes = run.frame().sizes;
    const auto planes = run.frame().planes.download<float>(sizes.planes / 4);
    double worst = 0;
    uint64_t over = 0;
    for (int y = 0; y < scene.camera.height; ++y)
        for (int x = 0; x < scene.camera.width; ++x) {
            const size_t at = size_t(y) * sizes.stride + size_t(x);
            double error = 0;
            for (size_t c = 0; c < 3; ++c) {
                const double e =
                    std::abs(planes[c * sizes.plane_floats + at] - expected.blended.color.at(x, y)[c]);
                error = std::isfinite(e) ? std::max(error, e) : INFINITY;
            }
            worst = std::max(worst, error);
            over += !(error <= kPixelBound);
        }
    const double pixels = double(scene.camera.width) * scene.camera.height;
    return {{"picture: share of pixels off by more than 1e-5", double(over) / pixels, kPixelShare},
            {"picture: worst pixel", worst, shared::ALPHA_MIN + kPixelBound}};
}

/// Loss and gradient of the whole pipeline.
std::vector<Check> check_gradient(const std::shared_ptr<gpu::Device>& device, const BenchScene& scene) {
    const RenderOptions options{.sh_degree = scene.gaussians.sh_degree};
    const LossGradient actual = loss_gradient(device, scene.gaussians, scene.camera, scene.image, options);
    const auto expected = reference::loss_gradient(scene.gaussians, scene.camera, scene.image, options);
    std::vector<Check> checks{{"loss", std::abs(actual.loss - expected.loss), 1e-5}};
    for_each_group(actual.gradient, expected.gradient, [&](const char* name, const auto& a, const auto& e) {
        checks.push_back(
            {std::string("gradient: ") + name + ", relative", relative_distance(a, e), kGradientBound});
    });
    return checks;
}

/// One Adam step from zero moments against the CPU reference, with the gradient that the moments hold.
std::vector<Check> check_update(const std::shared_ptr<gpu::Device>& device, const BenchScene& scene) {
    // The first step has rate zero: it changes only the moments, which then hold the second step's gradient.
    FrameRun run(device, scene, true, {}, {}, 32);
    const Gaussians m = download_model(run.model(), run.model().moments1);
    const Gaussians v = download_model(run.model(), run.model().moments2);
    constexpr float kRate = 0.01f;
    run.set_rates({kRate, kRate, kRate, kRate, kRate, kRate, 2});
    run.run();
    const Gaussians moved = download_model(run.model(), run.model().params);
    double worst = 0;
    for (const auto group : {&Gaussians::means, &Gaussians::quaternions, &Gaussians::log_scales,
                             &Gaussians::opacity_logits, &Gaussians::sh})
        for (size_t i = 0; i < (moved.*group).size(); ++i) {
            const float m1 = (m.*group)[i], v1 = (v.*group)[i];
            // A second moment near the smallest float32 has lost its digits, and the step depends on them.
            if (v1 != 0 && v1 < 1e-30f) continue;
            reference::AdamState state(1);
            state.m[0] = m1;
            state.v[0] = v1;
            double value = (scene.gaussians.*group)[i];
            const double gradient = m1 / (1 - shared::ADAM_BETA1);
            reference::adam_step(std::span(&value, 1), std::span(&gradient, 1), state, kRate, 2);
            worst = std::max(worst, std::abs(value - double((moved.*group)[i])) / kRate);
        }
    return {{"Adam: step, in learning rates", worst, kAdamBound}};
}

}  // namespace

void check_frame(CaseResult& result, const std::shared_ptr<gpu::Device>& device, FrameRun& run,
                 const BenchScene& scene) {
    const Case& one = result.one;
    const auto add = [&](const std::vector<Check>& checks) {
        result.checks.insert(result.checks.end(), checks.begin(), checks.end());
    };
    add(check_lists(run, scene));
    if (one.splats > 100000 || int64_t(one.width) * one.height > 960 * 540) {
        result.note = "picture and gradient not checked: the CPU reference would take minutes";
        return;
    }
    add(check_picture(run, scene));
    if (one.kind == Kind::train) add(check_gradient(device, scene));
    if (one.kind == Kind::update) add(check_update(device, scene));
}

}  // namespace ewa::bench
