// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <utility>

#include "operators/blend_frame.h"
#include "operators/context.h"
#include "operators/device_lists.h"
#include "passes/passes.h"
#include "pipeline/frame_passes.h"

namespace ewa {
namespace operators {
namespace {

using pipeline::FrameRequest;
using pipeline::Sizes;

uint32_t divide_up(uint32_t a, uint32_t b) {
    return (a + b - 1) / b;
}

void check_mask(const BlendOptions& options) {
    if (options.tile_mask.empty()) return;
    if (options.mask_tile_size == 0) throw InputError("a tile size of 0 px");
    const size_t tiles = size_t(divide_up(options.width, options.mask_tile_size)) *
                         divide_up(options.height, options.mask_tile_size);
    check_size("tile_mask", options.tile_mask.size(), tiles, "[tile rows, tile columns]");
}

void check_splats(const ScreenSplats& splats, const BlendOptions& options) {
    if (splats.channels == 0) throw InputError("features of no channels");
    if (splats.size() > 0x7fffffffu / std::max(splats.channels, 3u))
        throw InputError(std::to_string(splats.size()) + " splats are more than one image can have");
    check_size("means2d", splats.means2d.size(), splats.size() * 2, "[M, 2]");
    check_size("conics", splats.conics.size(), splats.size() * 3, "[M, 3]");
    check_size("features", splats.features.size(), splats.size() * splats.channels, "[M, D]");
    if (!options.background.empty())
        check_size("background", options.background.size(), splats.channels, "[D]");
    check_mask(options);
}

std::unique_ptr<BlendFrame> take_frame(const std::shared_ptr<Context>& context, bool gradients) {
    const std::lock_guard lock(context->frames_mutex);
    auto& frames = context->free_frames;
    const auto found =
        std::ranges::find(frames, gradients, [](const auto& frame) { return frame->gradients; });
    if (found != frames.end()) {
        std::unique_ptr<BlendFrame> frame = std::move(*found);
        frames.erase(found);
        return frame;
    }
    auto frame = std::make_unique<BlendFrame>();
    frame->device = context->device;
    frame->context = context;
    frame->gradients = gradients;
    return frame;
}

/// Whether the exponent of a footprint changes faster down a column than the low-pass lets it: yy of the conic is above
/// 1 / LOW_PASS.
bool has_sharp(const ScreenSplats& splats) {
    constexpr float kMost = float(1.01 / shared::LOW_PASS);
    for (size_t i = 0; i < splats.size(); ++i) {
        const float* shape = &splats.conics[3 * i];
        const float skew = shape[0] * shape[1];
        const float yy = splats.whiteners ? 2 * (shape[2] * shape[2] + skew * skew) : shape[2];
        if (yy > kMost) return true;
    }
    return false;
}

/// A blending pass's constants: its mode, whether it computes every pixel's exponential, and whether instances have parts.
passes::Constants blend_variant(const BlendFrame& f, uint32_t mode) {
    passes::Constants constants{{shared::SPEC_MODE, mode}};
    if (f.sharp) constants.push_back({shared::SPEC_SHARP, 1});
    if (f.parts) constants.push_back({shared::SPEC_PARTS, 1});
    return constants;
}

void describe_image(BlendFrame& f, const ScreenSplats& splats, const BlendOptions& options) {
    f.splats = uint32_t(splats.size());
    f.channels = splats.channels;
    f.width = options.width;
    f.height = options.height;
    f.whiteners = splats.whiteners;
    f.parts = false;
    f.sharp = has_sharp(splats);
    f.background.assign(options.background.begin(), options.background.end());
    f.background.resize(f.channels, 0.0f);
    f.tile_mask.assign(options.tile_mask.begin(), options.tile_mask.end());
    f.mask_tile_size = options.mask_tile_size;
}

FrameRequest request_of(const BlendFrame& f, const BlendOptions& options, uint32_t instances) {
    return {.splats = f.splats,
            .width = f.width,
            .height = f.height,
            .instances = instances,
            .gradients = options.gradients,
            .fifth_plane = f.channels > 3,
            .given_gradient = true,
            .overlaid = options.gradients};
}

bool has_fourth(const BlendFrame& f, uint32_t group) {
    return f.channels > kGroup * group + 3;
}

void record_collect(const passes::Recorder& on, const BlendFrame& f, uint32_t group, uint32_t mode) {
    if (f.whiteners) mode |= shared::SHAPE_WHITENERS;
    // A binding that a mode does not use gets the records.
    const auto or_records = [&](const Array& array) -> const gpu::Buffer& {
        return array.buffer() ? array.buffer() : f.frame.records;
    };
    on.record(passes::CollectRecords{.means = f.means.buffer(),
                                     .shapes = f.conics.buffer(),
                                     .opacities = f.opacities.buffer(),
                                     .features = f.features.buffer(),
                                     .depths = or_records(f.depths),
                                     .radii = or_records(f.radii),
                                     .records = f.frame.records,
                                     .depth_keys = f.frame.depth_keys[0],
                                     .tile_counts = f.frame.tile_counts,
                                     .counts = f.frame.counts},
              {.splats = f.splats,
               .channels = f.channels,
               .first_channel = kGroup * group,
               .size = {f.width, f.height}},
              {{shared::SPEC_MODE, mode}});
}

/// The buffers of blending a group.
passes::BlendBuffers buffers_of(const BlendFrame& f, uint32_t group) {
    return {.records = f.frame.records,
            .splats = f.frame.instance_splats[1],
            .tile_starts = f.frame.tile_starts,
            .planes = f.planes(group)};
}

/// The background is added on the host.
shared::BlendPush push_of(const passes::Recorder& on, const BlendFrame& f) {
    return pipeline::blend_push(on.cache.config(), f.frame, {0, 0, 0});
}

/// Blends all groups. mode: of the first group's collection.
void record_blend(const passes::Recorder& on, const BlendFrame& f, uint32_t mode) {
    for (uint32_t group = 0; group < f.groups(); ++group) {
        if (group > 0) record_collect(on, f, group, mode | shared::COLLECT_FEATURES);
        on.record(passes::Blend{buffers_of(f, group), f.frame.instance_splats[1]}, push_of(on, f),
                  blend_variant(f, has_fourth(f, group) ? shared::BLEND_DEPTH : shared::BLEND_COLOR));
    }
}

void reserve_planes(Context& context, BlendFrame& f) {
    f.more_planes.resize(std::max<size_t>(f.more_planes.size(), f.groups() - 1));
    for (uint32_t group = 1; group < f.groups(); ++group) {
        gpu::Buffer& planes = f.more_planes[group - 1];
        if (planes && planes.bytes() >= f.frame.sizes.planes) continue;
        planes = gpu::Buffer();
        planes = gpu::Buffer(*context.device, "planes", f.frame.sizes.planes, gpu::Texel::rgba32f);
    }
}

void upload_splats(Context& context, BlendFrame& f, const ScreenSplats& splats) {
    gpu::Device& device = *context.device;
    f.means.lend(device, splats.means2d);
    f.conics.lend(device, splats.conics);
    f.opacities.lend(device, splats.opacities);
    // The gradient reads the features of the other groups again, when the caller's array may be gone.
    if (f.groups() > 1)
        f.features.upload(device, splats.features);
    else
        f.features.lend(device, splats.features);
}

void give_back_splats(BlendFrame& f) {
    for (Array* array : {&f.means, &f.conics, &f.opacities, &f.features, &f.depths, &f.radii})
        array->give_back();
}

/// Plane of channel c of a group: red, green, blue, and depth.
uint32_t plane_of(uint32_t c) {
    return c < 3 ? shared::PLANE_R + c : shared::PLANE_DEPTH;
}

/// The planes of a group: the device's memory itself where the host reads it fast, or `copy`.
const float* read_planes(const BlendFrame& f, uint32_t group, std::vector<float>& copy) {
    if (const std::byte* in_place = f.planes(group).readable())
        return reinterpret_cast<const float*>(in_place);
    copy = f.planes(group).download<float>(f.frame.sizes.planes / sizeof(float));
    return copy.data();
}

BlendedImage image_of(BlendFrame& f) {
    const Sizes& s = f.frame.sizes;
    const size_t pixels = size_t(f.width) * f.height, channels = f.channels;
    BlendedImage image;
    image.features.resize(pixels * channels);
    image.alphas.resize(pixels);
    f.transmittances.resize(pixels);
    std::vector<float> copy;
    for (uint32_t group = 0; group < f.groups(); ++group) {
        const float* planes = read_planes(f, group, copy);
        const uint32_t first = kGroup * group, count = std::min(f.channels - first, kGroup);
        for (uint32_t y = 0; y < f.height; ++y) {
            const size_t row = size_t(y) * s.stride, at = size_t(y) * f.width;
            const float* left = planes + size_t(shared::PLANE_T) * s.plane_floats + row;
            for (uint32_t c = 0; c < count; ++c) {
                const float* from = planes + size_t(plane_of(c)) * s.plane_floats + row;
                const float background = f.background[first + c];
                float* to = &image.features[at * channels + first + c];
                for (uint32_t x = 0; x < f.width; ++x) to[x * channels] = from[x] + left[x] * background;
            }
            if (group == 0) std::copy_n(left, f.width, &f.transmittances[at]);
        }
    }
    if (!f.tile_mask.empty())
        for (uint32_t y = 0; y < f.height; ++y)
            for (uint32_t x = 0; x < f.width; ++x)
                if (!f.drawn(x, y)) {
                    const size_t at = size_t(y) * f.width + x;
                    f.transmittances[at] = 1;
                    std::copy(f.background.begin(), f.background.end(), &image.features[at * channels]);
                }
    for (size_t i = 0; i < pixels; ++i) image.alphas[i] = 1.0f - f.transmittances[i];
    return image;
}

constexpr size_t kGradientPlanes = 5;

/// The planes of an image gradient, with zeros where the tile mask has none.
void fill_gradient(const BlendFrame& f, uint32_t group, std::span<const float> features,
                   std::span<const float> alphas, float* planes) {
    const Sizes& s = f.frame.sizes;
    std::fill_n(planes, kGradientPlanes * s.plane_floats, 0.0f);
    const uint32_t first = kGroup * group, count = std::min(f.channels - first, kGroup);
    for (uint32_t y = 0; y < f.height; ++y) {
        const size_t row = size_t(y) * s.stride, at = size_t(y) * f.width;
        float* left = planes + size_t(shared::PLANE_T) * s.plane_floats + row;
        if (group == 0 && !alphas.empty())
            for (uint32_t x = 0; x < f.width; ++x) left[x] = -alphas[at + x];
        for (uint32_t c = 0; c < count; ++c) {
            float* to = planes + size_t(plane_of(c)) * s.plane_floats + row;
            const float* from = &features[at * f.channels + first + c];
            const float background = f.background[first + c];
            for (uint32_t x = 0; x < f.width; ++x) {
                to[x] = from[size_t(x) * f.channels];
                left[x] += to[x] * background;
            }
        }
        if (f.tile_mask.empty()) continue;
        for (uint32_t x = 0; x < f.width; ++x)
            if (!f.drawn(x, y))
                for (size_t p = 0; p < kGradientPlanes; ++p) planes[p * s.plane_floats + row + x] = 0;
    }
}

/// Writes a group of an image gradient to the device: in place, or through `copy` where the host cannot.
void upload_image_gradient(BlendFrame& f, uint32_t group, std::span<const float> features,
                           std::span<const float> alphas, std::vector<float>& copy) {
    gpu::Buffer& buffer = f.frame.image_gradient;
    if (buffer.readable())
        return fill_gradient(f, group, features, alphas, reinterpret_cast<float*>(buffer.mapped()));
    copy.resize(kGradientPlanes * f.frame.sizes.plane_floats);
    fill_gradient(f, group, features, alphas, copy.data());
    buffer.upload(std::span<const float>(copy));
}

/// What blend_absolute.comp reads of the pixels: texels of 4 channels, group by group, and one of the light behind all splats.
std::vector<float> absolute_inputs(const BlendFrame& f, std::span<const float> features,
                                   std::span<const float> alphas) {
    const Sizes& s = f.frame.sizes;
    const size_t pixels = size_t(f.width) * f.height, groups = f.groups();
    std::vector<float> texels(4 * pixels * (groups + 1));
    float* const rest = &texels[4 * pixels * groups];
    std::vector<float> gradient(kGradientPlanes * s.plane_floats), copy;
    for (uint32_t group = 0; group < groups; ++group) {
        fill_gradient(f, group, features, alphas, gradient.data());
        const float* image = read_planes(f, group, copy);
        const uint32_t count = std::min(f.channels - kGroup * group, kGroup);
        for (size_t i = 0; i < pixels; ++i) {
            const size_t at = i / f.width * s.stride + i % f.width;
            const auto add = [&](uint32_t plane) {
                const size_t k = size_t(plane) * s.plane_floats + at;
                rest[4 * i] += gradient[k] * image[k];
                return gradient[k];
            };
            for (uint32_t c = 0; c < count; ++c) texels[4 * (group * pixels + i) + c] = add(plane_of(c));
            add(shared::PLANE_T);
        }
    }
    return texels;
}

std::vector<float> background_gradient(const BlendFrame& f, std::span<const float> features) {
    std::vector<double> sums(f.channels, 0.0);
    for (size_t i = 0; i < f.transmittances.size(); ++i)
        for (uint32_t c = 0; c < f.channels; ++c)
            sums[c] += double(f.transmittances[i]) * double(features[i * f.channels + c]);
    return {sums.begin(), sums.end()};
}

/// Adds the slots of each splat. first: the channel of the slots' first colour. mode: GATHER_* bits.
void record_gather(const passes::Recorder& on, const BlendFrame& f, uint32_t first, uint32_t mode) {
    if (f.whiteners) mode |= shared::SHAPE_WHITENERS;
    on.record(passes::GatherSlots{.records = f.frame.records,
                                  .slots = f.frame.slots,
                                  .tile_counts = f.frame.tile_counts,
                                  .first_instances = f.frame.first_instances,
                                  .sorted_indices = f.frame.sorted_indices[1],
                                  .means = f.means_gradient.buffer(),
                                  .shapes = f.conics_gradient.buffer(),
                                  .opacities = f.opacities_gradient.buffer(),
                                  .features = f.features_gradient.buffer(),
                                  .absolute = f.absolute_gradient.buffer()},
              {.splats = f.splats, .channels = f.channels, .first_channel = first},
              {{shared::SPEC_MODE, mode}});
}

void record_gradient(const passes::Recorder& on, const BlendFrame& f, uint32_t group, bool absolute) {
    uint32_t blend = shared::BLEND_BACKWARD_ALPHA, gather = group > 0 ? shared::GATHER_ADD : 0;
    if (absolute) {
        blend |= shared::BLEND_BACKWARD_ABSOLUTE;
        gather |= shared::GATHER_ABSOLUTE;
    }
    if (has_fourth(f, group)) {
        blend |= shared::BLEND_BACKWARD_FOURTH;
        gather |= shared::GATHER_FOURTH;
    }
    if (f.groups() > 1) record_collect(on, f, group, shared::COLLECT_FEATURES);
    on.record(passes::BlendBackward{{buffers_of(f, group), f.frame.image_gradient, f.frame.slots},
                                    f.frame.instance_splats[1]},
              push_of(on, f), blend_variant(f, blend));
    record_gather(on, f, kGroup * group, gather);
}

/// The absolute gradients of an image with several groups. The other gradients stay: their sums in the slots are 0.
void record_absolute(const passes::Recorder& on, const BlendFrame& f) {
    on.recording.fill(f.absolute_gradient.buffer(), 0, 0, uint64_t(f.splats) * 8);
    on.record(passes::BlendAbsolute{.records = f.frame.records,
                                    .splats = f.frame.instance_splats[1],
                                    .tile_starts = f.frame.tile_starts,
                                    .features = f.features.buffer(),
                                    .pixels = f.pixel_gradients.buffer(),
                                    .slots = f.frame.slots},
              push_of(on, f), blend_variant(f, f.channels));
    record_gather(on, f, f.channels, shared::GATHER_ADD | shared::GATHER_ABSOLUTE);
}

}  // namespace
}  // namespace operators

using namespace operators;

Operators::Operators(std::shared_ptr<gpu::Device> device)
    : context_(std::make_shared<Context>(std::move(device))) {}
Operators::~Operators() = default;

BlendRecord::BlendRecord(std::unique_ptr<BlendFrame> frame) : frame_(std::move(frame)) {}

BlendRecord::~BlendRecord() {
    const std::shared_ptr<Context> context = frame_->context.lock();
    if (!context) return;
    constexpr size_t kKept = 4;
    const std::lock_guard lock(context->frames_mutex);
    if (context->free_frames.size() < kKept) context->free_frames.push_back(std::move(frame_));
}

BlendedImage Operators::blend(const ScreenSplats& splats, const DepthOrder& order,
                              const BlendOptions& options) {
    check_splats(splats, options);
    check_size("depths", order.depths.size(), splats.size(), "[M]");
    if (!order.radii.empty()) check_size("radii", order.radii.size(), splats.size() * 2, "[M, 2]");
    Context& context = *context_;
    const std::lock_guard lock(context.mutex);
    auto record = std::shared_ptr<BlendRecord>(new BlendRecord(take_frame(context_, options.gradients)));
    BlendFrame& f = *record->frame_;
    describe_image(f, splats, options);
    const uint32_t capacity = std::max(f.frame.instance_capacity, pipeline::first_capacity(splats.size()));
    const FrameRequest request = request_of(f, options, capacity);
    upload_splats(context, f, splats);
    f.depths.lend(*context.device, order.depths);
    f.radii.lend(*context.device, order.radii);
    const uint32_t mode = order.radii.empty() ? 0 : shared::COLLECT_RADII;
    const shared::Counts counts = pipeline::run_until_it_fits(
        context.cache, context.executor, f.frame, request, [&](const passes::Recorder& on) {
            reserve_planes(context, f);
            on.recording.fill(f.frame.counts, 0, 0, sizeof(shared::Counts));
            record_collect(on, f, 0, mode);
            pipeline::record_tile_lists(on, options.gradients, f.splats, f.frame);
            record_blend(on, f, mode);
        });
    give_back_splats(f);
    BlendedImage image = image_of(f);
    image.skipped_nonfinite = counts.skipped_nonfinite;
    if (options.gradients) image.record = std::move(record);
    return image;
}

BlendedImage Operators::blend(const ScreenSplats& splats, const TileLists& lists,
                              const BlendOptions& options) {
    check_splats(splats, options);
    Context& context = *context_;
    const passes::KernelConfig& config = context.cache.config();
    const std::lock_guard lock(context.mutex);
    auto record = std::shared_ptr<BlendRecord>(new BlendRecord(take_frame(context_, options.gradients)));
    BlendFrame& f = *record->frame_;
    describe_image(f, splats, options);
    f.parts = lists.tile_size > 0 && have_parts(lists, config);
    const DeviceLists d =
        device_lists(splats, lists, pipeline::sizes_for(config, request_of(f, options, 1)), config,
                     [&](uint32_t instances) {
                         f.frame.reserve(*context.device, config, request_of(f, options, instances));
                     });
    upload_splats(context, f, splats);
    f.frame.instance_splats[1].upload(std::span<const uint32_t>(d.splats));
    f.frame.tile_starts.upload(std::span<const uint32_t>(d.tile_starts));
    f.frame.tile_counts.upload(std::span<const uint32_t>(d.tile_counts));
    if (options.gradients) {
        f.frame.sorted_indices[1].upload(std::span<const uint32_t>(d.sorted_indices));
        f.frame.first_instances.upload(std::span<const uint32_t>(d.first_instances));
    }
    reserve_planes(context, f);
    gpu::Recording recording(context.device->limits());
    recording.fill(f.frame.counts, 0, 0, sizeof(shared::Counts));
    const passes::Recorder on{recording, context.cache};
    record_collect(on, f, 0, shared::COLLECT_LISTED);
    record_blend(on, f, shared::COLLECT_LISTED);
    f.frame.record_counts(recording);
    context.executor.run(recording);
    give_back_splats(f);
    BlendedImage image = image_of(f);
    image.skipped_nonfinite = f.frame.read_counts().skipped_nonfinite;
    if (options.gradients) image.record = std::move(record);
    return image;
}

ScreenGradient Operators::blend_backward(const BlendRecord& record, std::span<const float> features_gradient,
                                         std::span<const float> alphas_gradient, bool absolute) {
    BlendFrame& f = *record.frame_;
    if (f.context.lock() != context_) throw InputError("a record of other operators than these");
    const size_t pixels = size_t(f.width) * f.height, n = f.splats;
    check_size("features_gradient", features_gradient.size(), pixels * f.channels, "[H, W, D]");
    if (!alphas_gradient.empty()) check_size("alphas_gradient", alphas_gradient.size(), pixels, "[H, W]");
    Context& context = *context_;
    const std::lock_guard lock(context.mutex);
    gpu::Device& device = *context.device;
    f.means_gradient.reserve(device, n * 8);
    f.conics_gradient.reserve(device, n * 12);
    f.opacities_gradient.reserve(device, n * 4);
    f.features_gradient.reserve(device, n * 4 * f.channels);
    f.absolute_gradient.reserve(device, absolute ? n * 8 : 16);
    const bool apart = absolute && f.groups() > 1 && n > 0;
    std::vector<float> copy;
    for (uint32_t group = 0; group < f.groups(); ++group) {
        upload_image_gradient(f, group, features_gradient, alphas_gradient, copy);
        gpu::Recording recording(device.limits());
        record_gradient({recording, context.cache}, f, group, absolute && !apart);
        context.executor.run(recording);
    }
    if (apart) {
        const std::vector<float> pixel_texels = absolute_inputs(f, features_gradient, alphas_gradient);
        f.pixel_gradients.upload(device, std::span<const float>(pixel_texels));
        gpu::Recording recording(device.limits());
        record_absolute({recording, context.cache}, f);
        context.executor.run(recording);
    }
    ScreenGradient gradient;
    gradient.means2d = f.means_gradient.download<float>(2 * n);
    gradient.conics = f.conics_gradient.download<float>(3 * n);
    gradient.opacities = f.opacities_gradient.download<float>(n);
    gradient.features = f.features_gradient.download<float>(n * f.channels);
    gradient.background = background_gradient(f, features_gradient);
    if (absolute) gradient.absolute = f.absolute_gradient.download<float>(2 * n);
    return gradient;
}

}  // namespace ewa
