// SPDX-License-Identifier: Apache-2.0
#include "bench/accuracy.h"

#include <algorithm>
#include <chrono>
#include <cmath>

#include "bench/ceiling/ceiling.h"
#include "bench/device_runs.h"
#include "reference/volume.h"
#include "shared/constants.h"

namespace ewa::bench {
namespace {

using Clock = std::chrono::steady_clock;
constexpr int kPixelsWanted = 3000, kRuns = 7;

struct Pixel {
    int x = 0, y = 0;
};

std::vector<Pixel> spread_pixels(const Camera& camera) {
    const int step = std::max(1, int(std::sqrt(double(camera.width) * camera.height / kPixelsWanted)));
    std::vector<Pixel> pixels;
    for (int y = step / 2; y < camera.height; y += step)
        for (int x = step / 2; x < camera.width; x += step) pixels.push_back({x, y});
    return pixels;
}

/// Computes all pixels on all host threads. Returns seconds.
template <class Evaluate>
double evaluate_pixels(const std::vector<Pixel>& pixels, std::vector<glm::dvec3>& out, Evaluate evaluate) {
    out.resize(pixels.size());
    const auto start = Clock::now();
    for_all(uint32_t(pixels.size()),
            [&](uint32_t i) { out[i] = evaluate(pixels[i].x + 0.5, pixels[i].y + 0.5); });
    return std::chrono::duration<double>(Clock::now() - start).count();
}

void take_error(const std::vector<glm::dvec3>& exact, const std::vector<glm::dvec3>& actual,
                report::WorkPoint& point) {
    double sum = 0;
    for (size_t i = 0; i < exact.size(); ++i)
        for (int c = 0; c < 3; ++c) {
            const double e = std::abs(exact[i][c] - actual[i][c]);
            sum += e * e;
            point.worst = std::max(point.worst, e);
        }
    point.error = std::sqrt(sum / (3.0 * double(exact.size())));
}

struct SplattingChoice {
    std::string series, name;
    Footprint kernel = Footprint::peak;
    int sh_degree = 3;
    double alpha_min = shared::ALPHA_MIN;
    uint32_t tile_height = 0;  // 0: the tile of the device
};

/// Renders the frame several times. Returns its error and the median time.
report::WorkPoint splat(const std::shared_ptr<gpu::Device>& device, const BenchScene& scene,
                        RenderOptions options, const SplattingChoice& choice,
                        const std::vector<Pixel>& pixels, const std::vector<glm::dvec3>& exact) {
    options.kernel = choice.kernel;
    options.sh_degree = choice.sh_degree;
    passes::KernelConfig config = passes::config_for(device->limits());
    config.cut_off = float(choice.alpha_min);
    if (choice.tile_height > 0) config.tile_height = choice.tile_height;
    FrameRun run(device, scene, false, options, config);
    report::WorkPoint point;
    point.name = choice.name;
    point.time = time_repeated(kRuns, [&] { run.run(); }).wall.median;
    const pipeline::FrameBuffers& frame = run.frame();
    const auto planes = frame.planes.download<float>(frame.sizes.planes / 4);
    std::vector<glm::dvec3> actual;
    for (const Pixel& p : pixels) {
        const size_t at = size_t(p.y) * frame.sizes.stride + size_t(p.x), plane = frame.sizes.plane_floats;
        actual.emplace_back(planes[at], planes[plane + at], planes[2 * plane + at]);
    }
    take_error(exact, actual, point);
    return point;
}

std::vector<SplattingChoice> splatting_choices(const Gaussians& gaussians, const gpu::Limits& limits) {
    SplattingChoice plain;
    plain.sh_degree = sh_degree_present(gaussians);
    std::vector<SplattingChoice> choices;
    const auto add = [&](const char* series, const std::string& name) -> SplattingChoice& {
        choices.push_back(plain);
        choices.back().series = series;
        choices.back().name = name;
        return choices.back();
    };
    for (const int per : {16, 64, 255, 1024, 4096})
        add("splatting, cut-off", "1/" + std::to_string(per)).alpha_min = 1.0 / per;
    for (int d = 0; d <= plain.sh_degree; ++d) add("splatting, SH degree", std::to_string(d)).sh_degree = d;
    const passes::KernelConfig config = passes::config_for(limits);
    for (const uint32_t height :
         {config.tile_height / 2, config.tile_height, 2 * config.tile_height, 4 * config.tile_height})
        add("splatting, tile", text_of("%ux%u", config.tile_width, height)).tile_height = height;
    add("splatting, kernel", "peak");
    add("splatting, kernel", "antialias").kernel = Footprint::antialias;
    add("splatting, kernel", "unit mass").kernel = Footprint::density;
    return choices;
}

}  // namespace

Accuracy measure_accuracy(const std::shared_ptr<gpu::Device>& device, const Gaussians& gaussians,
                          const Camera& camera, const RenderOptions& options,
                          const std::function<void(const std::string&)>& say) {
    Accuracy result;
    result.threads = host_threads();
    const std::vector<Pixel> pixels = spread_pixels(camera);
    result.pixels = int(pixels.size());
    say(text_of("integrals along %d rays in float64, %u threads", result.pixels, result.threads));
    RenderOptions whole = options;
    whole.sh_degree = kMaxShDegree;
    const reference::Volume volume(gaussians, camera, whole);
    std::vector<glm::dvec3> exact, actual;
    result.exact_seconds =
        evaluate_pixels(pixels, exact, [&](double x, double y) { return volume.exact(x, y); });

    say("splatting on the device");
    const BenchScene scene{gaussians, camera, {}};
    for (const SplattingChoice& choice : splatting_choices(gaussians, device->limits())) {
        if (result.series.empty() || result.series.back().name != choice.series)
            result.series.push_back({choice.series, choice.series == "splatting, cut-off", {}});
        result.series.back().points.push_back(splat(device, scene, options, choice, pixels, exact));
    }
    say("ray-marching on the host");
    report::WorkSeries marcher{"ray-marcher (host)", true, {}};
    const double share = double(camera.width) * camera.height / double(pixels.size());
    for (int samples = 4; samples <= 1024; samples *= 2) {
        report::WorkPoint point;
        point.name = std::to_string(samples) + " samples";
        point.time = 1000 * share * evaluate_pixels(pixels, actual, [&](double x, double y) {
                         return volume.marched(x, y, samples);
                     });
        take_error(exact, actual, point);
        marcher.points.push_back(point);
    }
    result.series.push_back(std::move(marcher));
    return result;
}

}  // namespace ewa::bench
