// SPDX-License-Identifier: Apache-2.0
// Images and gradients of a fixed scene: the public interface of the forward and backward frames.
#include "ewa/renderer.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <ranges>

#include "ewa/error.h"
#include "ewa/gpu_interop.h"
#include "passes/passes.h"
#include "pipeline/backward.h"
#include "pipeline/image_reader.h"
#include "pipeline/sky.h"
#include "pipeline/views.h"
#include "scene/looks.h"
#include "scene/readout.h"
#include "scene/splat_arrays.h"

namespace ewa {
namespace {

using namespace pipeline;

static_assert(kMarkSelected == shared::MARK_SELECTED && kMarkLocked == shared::MARK_LOCKED &&
              kMarkPreview == shared::MARK_PREVIEW);

/// The scene without coefficients above a degree, which is lower than its own.
Gaussians with_degree(const Gaussians& gaussians, int degree) {
    Gaussians result = gaussians;
    result.sh_degree = degree;
    result.resize(gaussians.size());
    const size_t from = gaussians.sh_stride(), to = result.sh_stride();
    for (size_t i = 0; i < gaussians.size(); ++i)
        std::copy_n(&gaussians.sh[i * from], to, &result.sh[i * to]);
    return result;
}

PlanRequest image_request(const Gaussians& gaussians, const RenderOptions& options) {
    check(gaussians);
    check(options);
    return {.purpose = Purpose::image,
            .scene_degree = gaussians.sh_degree,
            .present_degree = sh_degree_present(gaussians),
            .render = options};
}

}  // namespace

std::vector<PlanLine> plan_lines(const Gaussians& gaussians, const RenderOptions& options) {
    const PlanRequest request = image_request(gaussians, options);
    return describe(plan_for(request), request.scene_degree, gaussians.size());
}

/// A part of a scene that the device cannot hold. The host holds the parameters.
struct ScenePart {
    Model model;
    std::vector<std::byte> params;
    std::vector<uint8_t> marks;  // a byte a splat, if some splat of the scene is marked
};

struct Renderer::State {
    std::shared_ptr<gpu::Device> device;
    passes::PassCache cache;
    gpu::Executor executor;
    RenderOptions options;
    PlanRequest request;           // of the scene; drawings ask for more
    Model model;                   // without arrays if the scene is in parts
    std::vector<ScenePart> parts;  // of a scene that would take too much of the device's limit
    gpu::Buffer marks;             // a byte a splat of the scene or part, if some splat is marked
    uint32_t marked = 0;           // Mark bits that some splat has
    FrameBuffers frame;
    shared::Counts counts{};
    std::shared_ptr<const SkyMap> sky;  // that was uploaded
    SkyTexels sky_texels;
    gpu::Buffer packed;                 // host visible; allocated at the first render_bytes
    std::vector<gpu::Buffer> outgoing;  // of render_to, one for each target
    std::vector<uint8_t> bytes;

    State(std::shared_ptr<gpu::Device> d, const Gaussians& gaussians, const RenderOptions& o)
        : device(std::move(d)),
          cache(*device),
          executor(*device),
          options(o),
          request(image_request(gaussians, o)) {
        upload(gaussians);
    }
    void upload(const Gaussians& gaussians) {
        const int degree = plan_for(request).stored_degree;
        if (degree < gaussians.sh_degree) return upload(with_degree(gaussians, degree));
        parts.clear();
        // A training may have set the device's memory limit. The image may take the larger part of it.
        const uint64_t limit = device->memory_limit();
        if (limit > 0 && parameter_bytes(uint32_t(gaussians.size()), degree) > limit / 4)
            divide(gaussians, limit / 16);
        else
            model = upload_model(*device, gaussians, 0, false);
    }

    void divide(const Gaussians& gaussians, uint64_t part_bytes);
    void mark(std::span<const uint8_t> all);
    void upload_marks(std::span<const uint8_t> of_splats);
    /// Lists what a view sees of all parts: records for draw_list. Sets the counts.
    std::vector<std::byte> list(const Plan& plan, const FrameInputs& inputs, FrameRequest size);
    /// then: what to record after the image.
    template <class Record>
    void submit_parts(const Plan& plan, const FrameInputs& inputs, FrameRequest size, Record then);

    Plan plan_of(const DrawOptions& options) const;
    /// The sky on the device.
    SkyUse sky_of(const RenderOptions& look);
    /// then: what to record after the image.
    template <class Record>
    void submit(const Camera& camera, const Plan& plan, const RenderOptions& look, Record then);
    Rendering draw(const Camera& camera, const Plan& plan, const RenderOptions& look);
};

constexpr uint64_t kListedBytes = 16 * shared::RECORD_TEXELS;  // of a splat

void Renderer::State::divide(const Gaussians& gaussians, uint64_t part_bytes) {
    model = {};  // free the memory of an earlier scene
    const uint64_t block = parameter_bytes(1, gaussians.sh_degree);
    const size_t most = size_t(std::max<uint64_t>(part_bytes / block, 1)) * shared::PARAM_BLOCK;
    for (size_t first = 0; first < gaussians.size(); first += most) {
        const auto rows = std::views::iota(first, std::min(first + most, gaussians.size()));
        ScenePart& part = parts.emplace_back();
        part.model = upload_model(*device, scene::rows_of(gaussians, rows), 0, false);
        part.params = part.model.params.download<std::byte>(part.model.params.bytes());
        part.model.params = {};
    }
    model.splats = model.capacity = uint32_t(gaussians.size());
    model.origin = gaussians.origin;
}

void Renderer::State::mark(std::span<const uint8_t> all) {
    if (!all.empty() && all.size() != model.splats)
        throw InputError(std::to_string(all.size()) + " marks for " + std::to_string(model.splats) +
                         " splats");
    marked = 0;  // if the upload fails
    uint32_t bits = 0;
    for (const uint8_t each : all) bits |= each;
    if (bits == 0) return;
    if (parts.empty()) upload_marks(all);
    auto next = all.begin();
    for (ScenePart& part : parts) {
        part.marks.assign(next, next + part.model.splats);
        next += part.model.splats;
    }
    marked = bits;
}

void Renderer::State::upload_marks(std::span<const uint8_t> of_splats) {
    if (marks.bytes() < of_splats.size()) marks = gpu::Buffer(*device, "marks", of_splats.size());
    marks.upload(of_splats);
}

std::vector<std::byte> Renderer::State::list(const Plan& plan, const FrameInputs& inputs, FrameRequest size) {
    std::vector<std::byte> records;
    ViewBuffers buffers;
    counts = {};
    for (ScenePart& part : parts) {
        Model& m = part.model;
        m.params = parameter_buffer(*device, "params", gpu::Texel::rgba32f, m.splats, m.sh_degree);
        m.params.upload(std::span<const std::byte>(part.params));
        size.splats = m.splats;
        buffers.reserve(*device, m.splats, 1, 1, m.splats);
        frame.reserve(*device, cache.config(), size);
        gpu::Recording recording(device->limits());
        if (plan.reads_marks()) upload_marks(part.marks);
        FramePasses{{recording, cache}, plan, frame, inputs}.list(m, buffers, {});
        frame.record_counts(recording);
        executor.run(recording, true);
        m.params = {};
        const shared::Counts of_part = frame.read_counts();
        counts.skipped_nonfinite += of_part.skipped_nonfinite;
        const auto listed = buffers.visible.download<std::byte>(of_part.scan_total * kListedBytes);
        records.insert(records.end(), listed.begin(), listed.end());
    }
    return records;
}

template <class Record>
void Renderer::State::submit_parts(const Plan& plan, const FrameInputs& inputs, FrameRequest size,
                                   Record then) {
    size.instances = std::max(frame.instance_capacity, 1u);
    const std::vector<std::byte> records = list(plan, inputs, size);
    const uint32_t skipped = counts.skipped_nonfinite, listed = uint32_t(records.size() / kListedBytes);
    size.splats = std::max(listed, 1u);
    counts = run_until_it_fits(cache, executor, frame, size, [&](const passes::Recorder& on) {
        if (records.empty())
            on.recording.fill(frame.records, 0, 0, kListedBytes);
        else
            frame.records.upload(std::span<const std::byte>(records));
        FramePasses{on, plan, frame, inputs}.draw_list(size.splats);
        then(on);
    });
    counts.skipped_nonfinite = skipped;
    counts.visible = listed;
}

template <class Record>
void Renderer::State::submit(const Camera& camera, const Plan& plan, const RenderOptions& look, Record then) {
    scene::check_lens(look, camera);
    const gpu::Buffer block = upload_camera(*device, camera, cache.config(), model.origin);
    FrameInputs inputs = inputs_of(block, camera, look);
    if (plan.surface())
        inputs.background = {};
    else
        inputs.sky = sky_of(look);
    if (plan.reads_marks()) inputs.marks = &marks;
    FrameRequest size = frame_request(plan, inputs.camera.width, inputs.camera.height);
    size.splats = model.splats;
    size.instances = std::max(frame.instance_capacity, first_capacity(model.splats));
    if (!parts.empty()) {
        if (plan.surface())
            throw RunError("a scene that is larger than the device's limit shows no surfaces");
        if (plan.rays())
            throw RunError("a scene that is larger than the device's limit cannot be integrated along rays");
        submit_parts(plan, inputs, size, then);
        return;
    }
    counts = run_until_it_fits(cache, executor, frame, size, [&](const passes::Recorder& on) {
        FramePasses{on, plan, frame, inputs}.forward(model);
        then(on);
    });
}

Plan Renderer::State::plan_of(const DrawOptions& o) const {
    if (!(o.splat_scale > 0) || !std::isfinite(o.splat_scale))
        throw InputError("a splat scale of " + std::to_string(o.splat_scale) + ", not above zero");
    PlanRequest drawing = request;
    drawing.render = o.render;
    drawing.render.sh_degree = request.render.sh_degree;
    drawing.drawing = o.drawing;
    drawing.debug = true;
    drawing.splat_scale = o.splat_scale;
    drawing.marks = marked;
    drawing.plain_colors = o.plain_colors;
    return plan_for(drawing);
}

SkyUse Renderer::State::sky_of(const RenderOptions& look) {
    if (!look.sky) return {};
    if (look.sky != sky) sky_texels = SkyTexels(*device, *look.sky);
    sky = look.sky;
    return sky_texels.use();
}

/// To length 1; a zero stays.
void normalize_texels(Image& normals) {
    for (size_t i = 0; i < normals.pixels.size(); i += 3) {
        float* n = &normals.pixels[i];
        const float length = std::hypot(n[0], n[1], n[2]);
        for (int c = 0; c < 3; ++c) n[c] = length > 0 ? n[c] / length : 0;
    }
}

Rendering Renderer::State::draw(const Camera& camera, const Plan& plan, const RenderOptions& look) {
    submit(camera, plan, look, [](const passes::Recorder&) {});
    const ImageReader planes(frame);
    Rendering result;
    result.alpha = planes.image(shared::PLANE_T, 1);
    for (float& value : result.alpha.pixels) value = 1.0f - value;
    if (plan.drawing == Drawing::median_depth) {
        result.median_depth = planes.image(shared::PLANE_MEDIAN, 1);
        return result;
    }
    if (plan.drawing == Drawing::normal) {
        result.normal = planes.image(shared::PLANE_R, 3);
        normalize_texels(result.normal);
        return result;
    }
    result.color = planes.image(shared::PLANE_R, 3);
    if (plan.drawing == Drawing::count) result.count = planes.image(shared::PLANE_COUNT, 1);
    if (plan.drawing == Drawing::depth) {
        result.depth = planes.image(shared::PLANE_DEPTH, 1);
        for (size_t i = 0; i < result.depth.pixels.size(); ++i)
            if (result.alpha.pixels[i] > 0) result.depth.pixels[i] /= result.alpha.pixels[i];
    }
    return result;
}

Renderer::Renderer(std::shared_ptr<gpu::Device> device, const Gaussians& gaussians,
                   const RenderOptions& options)
    : state_(std::make_unique<State>(std::move(device), gaussians, options)) {}
Renderer::~Renderer() = default;
Renderer::Renderer(Renderer&&) noexcept = default;

Rendering Renderer::render(const Camera& camera, bool with_depth) {
    return render(camera, with_depth ? Drawing::depth : Drawing::color);
}

Rendering Renderer::render(const Camera& camera, Drawing drawing) {
    State& s = *state_;
    PlanRequest request = s.request;
    request.drawing = drawing;
    request.marks = s.marked;
    return s.draw(camera, plan_for(request), s.options);
}

Rendering Renderer::render(const Camera& camera, const DrawOptions& options) {
    return state_->draw(camera, state_->plan_of(options), options.render);
}

const std::vector<uint8_t>& Renderer::render_bytes(const Camera& camera, const DrawOptions& options) {
    State& s = *state_;
    s.submit(camera, s.plan_of(options), options.render, [&](const passes::Recorder& on) {
        const Sizes& sizes = s.frame.sizes;
        const uint64_t needed = uint64_t(sizes.plane_floats) * 4;
        if (!s.packed || s.packed.bytes() < needed) {
            s.packed = gpu::Buffer();
            s.packed = gpu::Buffer(*s.device, "packed", needed, gpu::Texel::none, false, true);
        }
        on.record(passes::Pack{.planes = s.frame.planes, .packed = s.packed},
                  {.plane_floats = sizes.plane_floats}, {{shared::SPEC_MODE, shared::PACK_OPAQUE}});
    });
    const size_t row = size_t(camera.width) * 4, stride = size_t(s.frame.sizes.stride) * 4;
    s.bytes.resize(row * size_t(camera.height));
    for (size_t y = 0; y < size_t(camera.height); ++y)
        std::memcpy(&s.bytes[y * row], s.packed.mapped() + y * stride, row);
    return s.bytes;
}

namespace {

uint32_t pack_mode(const DeviceTarget& target, Drawing drawing) {
    const bool depth = target.format == VK_FORMAT_R32_SFLOAT;
    if (depth && drawing != Drawing::depth) throw InputError("a target of R32_SFLOAT needs Drawing::depth");
    return depth                                            ? shared::PACK_DEPTH
           : target.format == VK_FORMAT_R32G32B32A32_SFLOAT ? shared::PACK_FLOATS
                                                            : shared::PACK_BYTES;
}

}  // namespace

void render_to(Renderer& renderer, const Camera& camera, const DrawOptions& options,
               std::span<const DeviceTarget> targets, const DeviceSync& sync) {
    Renderer::State& s = *renderer.state_;
    const Plan plan = s.plan_of(options);
    if (targets.empty()) throw InputError("a render to no target");
    if (plan.surface()) throw InputError("median depths and normals are not rendered to targets");
    std::vector<gpu::Executor::CopyOut> copies;
    s.submit(camera, plan, options.render, [&](const passes::Recorder& on) {
        const Sizes& sizes = s.frame.sizes;
        s.outgoing.resize(std::max(s.outgoing.size(), targets.size()));
        copies.clear();
        for (size_t i = 0; i < targets.size(); ++i) {
            gpu::check_target(targets[i], sizes.width, sizes.height);
            const uint32_t mode = pack_mode(targets[i], plan.drawing);
            const uint64_t needed = uint64_t(sizes.plane_floats) * gpu::pixel_bytes(targets[i].format);
            gpu::Buffer& packed = s.outgoing[i];
            if (!packed || packed.bytes() < needed) {
                packed = gpu::Buffer();
                packed = gpu::Buffer(*s.device, "outgoing", needed);
            }
            on.record(passes::Pack{.planes = s.frame.planes, .packed = packed},
                      {.plane_floats = sizes.plane_floats}, {{shared::SPEC_MODE, mode}});
            copies.push_back({&packed, sizes.stride, sizes.width, sizes.height, &targets[i]});
        }
    });
    s.executor.copy_out(copies, sync);
}

void Renderer::replace(const Gaussians& gaussians) {
    State& s = *state_;
    s.request = image_request(gaussians, s.options);
    s.model = {};  // free its memory first
    s.marks = {};
    s.marked = 0;
    s.upload(gaussians);
}

void Renderer::mark(std::span<const uint8_t> marks) {
    state_->mark(marks);
}

uint32_t Renderer::skipped_nonfinite() const {
    return state_->counts.skipped_nonfinite;
}

uint32_t Renderer::splats_drawn() const {
    return state_->counts.visible;
}

std::vector<PassTime> Renderer::pass_times() const {
    return state_->executor.timings();
}

LossGradient loss_gradient(std::shared_ptr<gpu::Device> device, const Gaussians& gaussians,
                           const Camera& camera, const Image& target, const RenderOptions& options,
                           bool alpha_is_weight, const LossWeights& weights, const Image& depths) {
    check(gaussians);
    check(target);
    check(depths);
    if (target.width != camera.width || target.height != camera.height || target.channels < 3 ||
        target.channels > 4)
        throw InputError("the training image is " + std::to_string(target.width) + "x" +
                         std::to_string(target.height) + " with " + std::to_string(target.channels) +
                         " channels, the camera " + std::to_string(camera.width) + "x" +
                         std::to_string(camera.height) + " RGB or RGBA");
    if (!depths.pixels.empty() && (depths.width != camera.width || depths.height != camera.height ||
                                   depths.channels != 1 || !camera.distortion.none() || camera.readout))
        throw InputError("a depth map has one channel and the size of its camera, which is a pinhole");
    scene::check_lens(options, camera);
    passes::PassCache cache(*device);
    gpu::Executor executor(*device);
    const bool cut = !alpha_is_weight && transparent(target);
    const Plan plan = plan_for({.purpose = Purpose::gradient,
                                .scene_degree = gaussians.sh_degree,
                                .render = options,
                                .loss = weights,
                                .masks = alpha_is_weight && target.channels == 4,
                                .alpha = cut,
                                .depths = !depths.pixels.empty(),
                                .motion = true});
    const Model model = upload_model(*device, gaussians, plan.moment_buffers(), false);
    const gpu::Buffer block = upload_camera(*device, camera, cache.config(), model.origin);
    const gpu::Buffer photo = upload_photo(*device, target);
    gpu::Buffer map;
    if (plan.loss.depth > 0) {
        map = gpu::Buffer(*device, "depth map", 4 * depths.pixels.size());
        map.upload(std::span<const float>(depths.pixels));
    }
    const SkyTexels sky = options.sky ? SkyTexels(*device, *options.sky) : SkyTexels();
    FrameInputs inputs = inputs_of(block, camera, options);
    if (options.sky) inputs.sky = sky.use();
    FrameRequest size = frame_request(plan, inputs.camera.width, inputs.camera.height);
    size.splats = model.splats;
    size.instances = first_capacity(model.splats);
    size.readouts = scene::moves(camera);
    FrameBuffers frame;
    const shared::Counts counts =
        run_until_it_fits(cache, executor, frame, size, [&](const passes::Recorder& recorder) {
            const FramePasses on{recorder, plan, frame, inputs};
            const Sorted sorted = on.forward(model);
            on.loss(photo, plan.masks, nullptr, cut, {map ? &map : nullptr});
            on.backward(model, sorted, {});
        });
    LossGradient result;
    result.l1 = counts.l1;
    result.l2 = counts.l2;
    result.ssim = counts.ssim;
    result.alpha = counts.alpha;
    result.depth = counts.depth;
    result.weights = plan.loss;
    result.loss = loss_of(plan.loss, counts);
    result.gradient = download_model(model, model.moments1);
    result.gradient.origin = glm::dvec3(0);  // a gradient has no origin
    if (plan.motion) result.camera = download_motion_gradient(frame, scene::moves(camera));
    result.skipped_nonfinite = counts.skipped_nonfinite;
    return result;
}

}  // namespace ewa
