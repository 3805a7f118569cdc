// SPDX-License-Identifier: Apache-2.0
// Pictures and gradients of a fixed scene: the public face of the forward and backward frames.
#include "ewa/renderer.h"

#include <algorithm>
#include <cmath>

#include "ewa/error.h"
#include "gpu/executor.h"
#include "pipeline/backward.h"
#include "pipeline/camera_block.h"
#include "pipeline/capacity.h"
#include "pipeline/photo.h"
#include "pipeline/plan.h"

namespace ewa {
namespace {

using namespace pipeline;

/// The scene with no coefficient above a degree.
Gaussians with_degree(const Gaussians& gaussians, int degree) {
    if (degree >= gaussians.sh_degree) return gaussians;
    Gaussians result = gaussians;
    result.sh_degree = degree;
    result.resize(gaussians.size());
    const size_t from = gaussians.sh_stride(), to = result.sh_stride();
    for (size_t i = 0; i < gaussians.size(); ++i)
        std::copy_n(&gaussians.sh[i * from], to, &result.sh[i * to]);
    return result;
}

gpu::Buffer upload_camera(gpu::Device& device, const Camera& camera, const passes::Shape& shape,
                          const glm::dvec3& origin) {
    const shared::CameraBlock block = camera_block(camera, shape, origin);
    gpu::Buffer buffer(device, "camera", sizeof(block), gpu::Texel::none, true);
    buffer.upload(std::span<const shared::CameraBlock>(&block, 1));
    return buffer;
}

/// One plane of an image, spread over channel c of a picture.
void copy_plane(const std::vector<float>& planes, const Sizes& sizes, uint32_t plane, Image& image,
                int channel) {
    for (int y = 0; y < image.height; ++y)
        for (int x = 0; x < image.width; ++x)
            image.at(x, y)[channel] =
                planes[size_t(plane) * sizes.plane_floats + size_t(y) * sizes.stride + size_t(x)];
}

}  // namespace

struct Renderer::State {
    std::shared_ptr<gpu::Device> device;
    Kernels kernels;
    gpu::Executor executor;
    RenderOptions options;
    Plan plan;
    Model model;
    Frame frame;
    uint32_t skipped = 0;

    State(std::shared_ptr<gpu::Device> d, const Gaussians& gaussians, const RenderOptions& o)
        : device(std::move(d)),
          kernels(*device),
          executor(*device),
          options(o),
          plan(plan_picture(gaussians, o, false)),
          model(upload_model(*device, with_degree(gaussians, plan.stored_degree), 0, false)) {}
};

Renderer::Renderer(std::shared_ptr<gpu::Device> device, const Gaussians& gaussians,
                   const RenderOptions& options)
    : state_(std::make_unique<State>(std::move(device), gaussians, options)) {}
Renderer::~Renderer() = default;
Renderer::Renderer(Renderer&&) noexcept = default;

Rendering Renderer::render(const Camera& camera, bool with_depth) {
    State& s = *state_;
    s.plan.depth = with_depth;
    const gpu::Buffer block = upload_camera(*s.device, camera, s.kernels.shape(), s.model.origin);
    const CameraUse use{&block, 0, uint32_t(camera.width), uint32_t(camera.height)};
    const uint32_t room = std::max(s.frame.instance_capacity, first_capacity(s.model.splats));
    const shared::Counts counts = run_until_it_fits(
        s.kernels, s.executor, s.frame, {s.model.splats, use.width, use.height, room, false, with_depth},
        [&](gpu::Recording& recording) {
            record_forward(recording, s.kernels, s.plan, s.model, s.frame, use, s.options.background);
        });
    s.skipped = counts.skipped_nonfinite;

    const Sizes& sizes = s.frame.sizes;
    const auto planes = s.frame.planes.download<float>(sizes.planes / 4);
    Rendering result{Image(camera.width, camera.height, 3), Image(camera.width, camera.height, 1), Image()};
    for (int c = 0; c < 3; ++c) copy_plane(planes, sizes, shared::PLANE_R + uint32_t(c), result.color, c);
    copy_plane(planes, sizes, shared::PLANE_T, result.alpha, 0);
    for (float& value : result.alpha.pixels) value = 1.0f - value;
    if (with_depth) {
        result.depth = Image(camera.width, camera.height, 1);
        copy_plane(planes, sizes, shared::PLANE_DEPTH, result.depth, 0);
        for (size_t i = 0; i < result.depth.pixels.size(); ++i)
            if (result.alpha.pixels[i] > 0) result.depth.pixels[i] /= result.alpha.pixels[i];
    }
    return result;
}

uint32_t Renderer::skipped_nonfinite() const {
    return state_->skipped;
}

std::vector<PassTime> Renderer::pass_times() const {
    std::vector<PassTime> times;
    for (const gpu::Timing& timing : state_->executor.timings())
        times.push_back({timing.name, timing.milliseconds});
    return times;
}

LossGradient loss_gradient(std::shared_ptr<gpu::Device> device, const Gaussians& gaussians,
                           const Camera& camera, const Image& target, const RenderOptions& options,
                           bool alpha_is_weight) {
    if (target.width != camera.width || target.height != camera.height || target.channels < 3)
        throw InputError("the photograph is " + std::to_string(target.width) + "x" +
                         std::to_string(target.height) + " with " + std::to_string(target.channels) +
                         " channels, the camera " + std::to_string(camera.width) + "x" +
                         std::to_string(camera.height) + " RGB");
    Kernels kernels(*device);
    gpu::Executor executor(*device);
    Plan plan = plan_gradient(gaussians, options);
    plan.masks = alpha_is_weight && target.channels == 4;
    const Model model = upload_model(*device, gaussians, 1, false);
    const gpu::Buffer block = upload_camera(*device, camera, kernels.shape(), model.origin);
    const gpu::Buffer photo = upload_photo(*device, target);
    const CameraUse use{&block, 0, uint32_t(camera.width), uint32_t(camera.height)};
    Frame frame;
    const shared::Counts counts = run_until_it_fits(
        kernels, executor, frame,
        {model.splats, use.width, use.height, first_capacity(model.splats), true, false, plan.masks},
        [&](gpu::Recording& recording) {
            const Sorted sorted =
                record_forward(recording, kernels, plan, model, frame, use, options.background);
            record_loss(recording, kernels, frame, use, options.background, photo, plan.masks);
            record_backward(recording, kernels, plan, model, frame, use, options.background, sorted, {});
        });
    LossGradient result;
    result.l1 = counts.l1;
    result.ssim = counts.ssim;
    result.loss = loss_of(counts);
    result.gradient = download_model(model, model.moments1);
    result.gradient.origin = glm::dvec3(0);  // a gradient stands nowhere
    result.skipped_nonfinite = counts.skipped_nonfinite;
    return result;
}

}  // namespace ewa
