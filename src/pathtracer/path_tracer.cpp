// SPDX-License-Identifier: Apache-2.0
#include "pathtracer/path_tracer.h"

#include <algorithm>
#include <cmath>

#include "ewa/error.h"
#include "scene/native_lens.h"
#include "scene/readout.h"

namespace ewa::pathtracer {

namespace {

/// The steps of one ray so that an invocation stays below the device's limit on loop iterations. Per bounce,
/// a path has a ray, a shadow ray, and an iteration of the loop over bounces.
uint32_t steps_for(const passes::KernelConfig& config, int samples) {
    const uint32_t surfaces = uint32_t(samples) * (shared::TRACE_BOUNCES + 1);
    return (config.loop_limit - surfaces - 1) / (2 * surfaces);
}

}  // namespace

PathTracer::PathTracer(std::shared_ptr<gpu::Device> device, const pathtracer::PackedScene& scene,
                       const scene::Sky& sky)
    : device_(std::move(device)),
      cache_(*device_),
      variant_{{shared::SPEC_ALPHA_TESTED, scene.alpha_tested ? 1u : 0u}, {shared::SPEC_COLOR_FLOATS, 0}},
      executor_(*device_),
      mesh_{upload("mesh nodes", scene.nodes, gpu::Texel::rgba32ui),
            upload("mesh triangles", scene.triangles, gpu::Texel::rgba32ui),
            upload("mesh surfaces", scene.surfaces, gpu::Texel::rgba32ui),
            upload("mesh materials", scene.materials, gpu::Texel::rgba32ui),
            upload("mesh textures", scene.textures, gpu::Texel::rgba32ui),
            upload("mesh texels", scene.texels, gpu::Texel::rgba8)},
      lights_(upload("mesh lights", scene.lights, gpu::Texel::rgba32ui)),
      counts_(*device_, "trace counts"),
      sky_(sky),
      origin_(scene.origin),
      unit_(scene.unit),
      light_count_(scene.light_count) {}

passes::MeshBuffers PathTracer::mesh() const {
    return {.nodes = mesh_.nodes,
            .triangles = mesh_.triangles,
            .surfaces = mesh_.surfaces,
            .materials = mesh_.materials,
            .textures = mesh_.textures,
            .texels = mesh_.texels};
}

gpu::Buffer PathTracer::upload(const char* name, const std::vector<uint32_t>& words, gpu::Texel texel) {
    gpu::Buffer buffer(*device_, name, words.size() * sizeof(uint32_t), texel);
    buffer.upload(std::span<const uint32_t>(words));
    return buffer;
}

gpu::Buffer PathTracer::view_of(const Camera& camera, double brightest) {
    if (camera.width < 1 || camera.height < 1 || !(camera.fx > 0) || !(camera.fy > 0))
        throw InputError("a camera's size or focal length is not above zero");
    shared::TraceView view{};
    const glm::dvec3 position = (camera.position() - origin_) / unit_;
    for (int row = 0; row < 3; ++row) {
        for (int column = 0; column < 3; ++column)
            view.rotation[3 * row + column] = float(camera.rotation[column][row]);
        view.position[row] = float(position[row]);
        view.zenith[row] = sky_.zenith[row];
        view.horizon[row] = sky_.horizon[row];
        view.ground[row] = sky_.ground[row];
    }
    view.focal[0] = float(camera.fx);
    view.focal[1] = float(camera.fy);
    view.center[0] = float(camera.cx);
    view.center[1] = float(camera.cy);
    view.size[0] = uint32_t(camera.width);
    view.size[1] = uint32_t(camera.height);
    view.sample_max = float(std::min(brightest, 3e38));
    gpu::Buffer buffer(*device_, "trace view", sizeof(view), gpu::Texel::none, true);
    buffer.upload(std::span<const shared::TraceView>(&view, 1));
    return buffer;
}

PathTracer::View PathTracer::see(const Camera& camera, double brightest) {
    View view{view_of(camera, brightest), {}, variant_};
    const bool lens = !camera.distortion.none() || scene::moves(camera);
    view.variant.push_back({shared::SPEC_LENSES, lens ? 1u : 0u});
    std::vector<float> rays(lens ? 0 : shared::PIXEL_RAY_FLOATS);
    const double limit = scene::lens_limit(camera);
    for (int y = 0; lens && y <= camera.height; ++y)
        for (int x = 0; x <= camera.width; ++x) {
            const auto ray = scene::world_ray(camera, limit, x, y);
            const glm::dvec3 origin = ((ray ? ray->origin : camera.position()) - origin_) / unit_;
            const glm::dvec3 direction = ray ? ray->direction : glm::dvec3(0);
            for (int i = 0; i < 3; ++i) rays.push_back(float(origin[i]));
            for (int i = 0; i < 3; ++i) rays.push_back(float(direction[i]));
        }
    view.rays = gpu::Buffer(*device_, "pixel rays", rays.size() * sizeof(float));
    view.rays.upload(std::span<const float>(rays));
    return view;
}

shared::TraceCounts PathTracer::trace_paths(const View& view, uint64_t pixels, int samples, uint64_t seed) {
    shared::TracePush push{};
    push.max_steps = steps_for(cache_.config(), samples_at_once_);
    push.lights = light_count_;
    push.seed[0] = uint32_t(seed);
    push.seed[1] = uint32_t(seed >> 32);
    const passes::TracePaths buffers{.mesh = mesh(),
                                     .lights = lights_,
                                     .view = view.block,
                                     .sums = sums_,
                                     .counts = counts_.buffer(),
                                     .pixel_rays = view.rays};
    const passes::Groups groups = passes::element_groups(cache_.config(), pixels);
    for (int first = 0; first < samples; first += samples_at_once_) {
        push.first_sample = uint32_t(first);
        push.samples = uint32_t(std::min(samples_at_once_, samples - first));
        // One submission each, because a device that also drives a desktop aborts long submissions.
        gpu::Recording recording(device_->limits());
        if (first == 0) {
            recording.fill(sums_, 0, 0, pixels * 16);
            counts_.clear(recording);
        }
        cache_.get<passes::TracePaths>(view.variant).record(recording, buffers, push, groups);
        if (first + samples_at_once_ >= samples) counts_.record(recording);
        executor_.run(recording);
    }
    return counts_.read();
}

Image PathTracer::radiance(const Camera& camera, int samples, uint64_t seed, double brightest) {
    const View view = see(camera, brightest);
    const uint64_t pixels = uint64_t(camera.width) * uint64_t(camera.height);
    if (!sums_ || sums_.bytes() < pixels * 16) {
        sums_ = {};
        sums_ = gpu::Buffer(*device_, "radiance sums", pixels * 16);
    }
    shared::TraceCounts counts = trace_paths(view, pixels, samples, seed);
    while (counts.unfinished_rays > 0 && samples_at_once_ > 1) {
        samples_at_once_ /= 2;
        counts = trace_paths(view, pixels, samples, seed);
    }
    unfinished_ += counts.unfinished_rays;
    dropped_ += counts.dropped_samples;
    Image image(camera.width, camera.height, 4);
    image.pixels = sums_.download<float>(pixels * 4);
    for (float& value : image.pixels) value /= float(samples);
    return image;
}

PathTracer::Seen PathTracer::seen(const Camera& camera) {
    const View view = see(camera, 0);
    const uint64_t pixels = uint64_t(camera.width) * uint64_t(camera.height);
    const gpu::Buffer found(*device_, "seen", pixels * 16);
    shared::TracePush push{};
    push.max_steps = cache_.config().loop_limit - 1;
    gpu::Recording recording(device_->limits());
    counts_.clear(recording);
    cache_.get<passes::TraceDepth>(view.variant)
        .record(recording,
                {.mesh = mesh(),
                 .view = view.block,
                 .seen = found,
                 .counts = counts_.buffer(),
                 .pixel_rays = view.rays},
                push, passes::element_groups(cache_.config(), pixels));
    counts_.record(recording);
    executor_.run(recording);
    unfinished_ += counts_.read().unfinished_rays;

    struct Pixel {
        float z;
        uint32_t triangle;
        float barycentric[2];
    };
    const auto values = found.download<Pixel>(pixels);
    Seen seen{Image(camera.width, camera.height, 1), std::vector<uint32_t>(pixels)};
    for (size_t i = 0; i < pixels; ++i) {
        seen.depth.pixels[i] = float(double(values[i].z) * unit_);
        seen.triangles[i] = values[i].triangle;
    }
    return seen;
}

}  // namespace ewa::pathtracer
