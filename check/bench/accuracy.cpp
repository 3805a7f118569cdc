// SPDX-License-Identifier: Apache-2.0
#include "bench/accuracy.h"

#include <algorithm>
#include <chrono>
#include <cmath>

#include "bench/ceiling/ceiling.h"
#include "bench/device_runs.h"
#include "core/progress.h"
#include "ewa/splat_edit.h"
#include "reference/volume.h"
#include "shared/constants.h"

namespace ewa::bench {
namespace {

using Clock = std::chrono::steady_clock;
using reference::Approximations;
using reference::Volume;
constexpr int kPixelsWanted = 3000, kRuns = 7;
constexpr uint32_t kRaysAtOnce = 64;
constexpr size_t kCauseStride = 3;  // of the pixels

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

using Colors = std::vector<glm::dvec3>;

/// Rays of the host, with progress over several passes of all pixels.
class HostRays {
  public:
    HostRays(const std::vector<Pixel>& pixels, const char* what, size_t passes)
        : pixels_(pixels), progress_(what, int(passes * pixels.size()), "rays", false) {}

    /// Computes all pixels on all host threads. Returns seconds. quick: so fast that progress does not count it.
    template <class Evaluate>
    double evaluate(Colors& out, Evaluate evaluate, bool quick = false) {
        out.resize(pixels_.size());
        const auto start = Clock::now();
        const auto count = uint32_t(pixels_.size());
        for (uint32_t first = 0; first < count; first += kRaysAtOnce) {
            const uint32_t rays = std::min(kRaysAtOnce, count - first);
            for_all(rays, [&](uint32_t i) {
                const Pixel& p = pixels_[first + i];
                out[first + i] = evaluate(p.x + 0.5, p.y + 0.5);
            });
            if (!quick) progress_.update(done_ += int(rays));
        }
        return std::chrono::duration<double>(Clock::now() - start).count();
    }

  private:
    const std::vector<Pixel>& pixels_;
    core::Progress progress_;
    int done_ = 0;
};

struct Error {
    double rms = 0, worst = 0;
};

Error error_of(const Colors& exact, const Colors& actual) {
    Error error;
    double sum = 0;
    for (size_t i = 0; i < exact.size(); ++i)
        for (int c = 0; c < 3; ++c) {
            const double e = std::abs(exact[i][c] - actual[i][c]);
            sum += e * e;
            error.worst = std::max(error.worst, e);
        }
    error.rms = std::sqrt(sum / (3.0 * double(exact.size())));
    return error;
}

/// One meaning of opacity, and its exact image.
struct Exact {
    const char* name;
    Footprint kernel;
    Gaussians gaussians;  // with opacities of this meaning
    Colors colors;
};

/// Both meanings, without their images.
std::vector<Exact> meanings_of(const Gaussians& gaussians) {
    std::vector<Exact> all{{"opacity", Footprint::peak, gaussians, {}},
                           {"density", Footprint::density, gaussians, {}}};
    for (Exact& one : all) fit_opacities(one.gaussians, one.kernel == Footprint::density);
    return all;
}

struct NamedApproximation {
    const char* name;
    bool Approximations::*flag;
};
constexpr NamedApproximation kApproximations[] = {
    {"overlap: splats one behind the other", &Approximations::overlap},
    {"order: by the depth of centres", &Approximations::order},
    {"formula: alpha = opacity G", &Approximations::formula},
    {"affine: Taylor expansion of the projection", &Approximations::affine},
    {"low-pass: 0.3 px^2", &Approximations::low_pass},
    {"cut-off: 1/255, and T at 1e-4", &Approximations::cut_off},
};
constexpr Approximations kSplatting{true, true, true, true, true, true};

/// A density's alpha is 1 - exp(-tau) in splatting, too.
bool applies(const NamedApproximation& one, Footprint kernel) {
    return one.flag != &Approximations::formula || kernel == Footprint::peak;
}

/// The error of each approximation, at a part of the pixels: that tells their sizes.
AccuracyReference causes_of(const Exact& exact, const Camera& camera, const RenderOptions& options,
                            const std::vector<Pixel>& all) {
    std::vector<Pixel> pixels;
    Colors right, colors;
    for (size_t i = 0; i < all.size(); i += kCauseStride) {
        pixels.push_back(all[i]);
        right.push_back(exact.colors[i]);
    }
    std::vector<NamedApproximation> causes;
    for (const NamedApproximation& one : kApproximations)
        if (applies(one, exact.kernel)) causes.push_back(one);
    // Each is switched on alone. Splatting without one of them is quick, unless splats then overlap.
    HostRays rays(pixels, "switched approximations on", causes.size());
    const auto error_with = [&](const Approximations& approximations) {
        const Volume volume(exact.gaussians, camera, options, approximations);
        rays.evaluate(
            colors, [&](double x, double y) { return volume.exact(x, y); }, approximations.overlap);
        return error_of(right, colors).rms;
    };
    AccuracyReference result{exact.name, error_with(kSplatting), {}};
    for (const NamedApproximation& one : causes) {
        Approximations alone, without = kSplatting;
        alone.*one.flag = true;
        without.*one.flag = false;
        result.causes.push_back({one.name, error_with(alone), error_with(without)});
    }
    return result;
}

/// One way to draw the scene on the device.
struct Way {
    std::string series, name;
    RenderOptions options;
    double cut_off = shared::ALPHA_MIN;
    size_t exact = 0;  // index of the exact image
};

/// Renders the frame several times. Returns its error and the median time.
report::WorkPoint draw(const std::shared_ptr<gpu::Device>& device, const BenchScene& scene, const Way& way,
                       const std::vector<Pixel>& pixels, const Colors& exact) {
    passes::KernelConfig config = passes::config_for(device->limits());
    config.cut_off = float(way.cut_off);
    FrameRun run(device, scene, false, way.options, config);
    report::WorkPoint point;
    point.name = way.name;
    point.time = time_repeated(kRuns, [&] { run.run(); }).wall.median;
    const pipeline::FrameBuffers& frame = run.frame();
    const auto planes = frame.planes.download<float>(frame.sizes.planes / 4);
    Colors actual;
    for (const Pixel& p : pixels) {
        const size_t at = size_t(p.y) * frame.sizes.stride + size_t(p.x), plane = frame.sizes.plane_floats;
        actual.emplace_back(planes[at], planes[plane + at], planes[2 * plane + at]);
    }
    const Error error = error_of(exact, actual);
    point.error = error.rms;
    point.worst = error.worst;
    return point;
}

std::vector<Way> ways_of(const std::vector<Exact>& exact, const RenderOptions& options, int sh_degree) {
    std::vector<Way> ways;
    for (size_t e = 0; e < exact.size(); ++e) {
        Way plain;
        plain.options = options;
        plain.options.kernel = exact[e].kernel;
        plain.options.integrator = Integrator::splat;
        plain.options.points = false;
        plain.options.sh_degree = sh_degree;
        plain.exact = e;
        const auto add = [&](const char* series, const std::string& name) -> Way& {
            ways.push_back(plain);
            ways.back().series = std::string(series) + ", " + exact[e].name;
            ways.back().name = name;
            return ways.back();
        };
        if (exact[e].kernel == Footprint::peak) {
            for (const int nearest : {1, 4, 16}) {
                Way& way = add("points", std::to_string(nearest) + " nearest");
                way.options.points = true;
                way.options.nearest = nearest;
            }
            for (int d = 0; d < sh_degree; ++d) add("SH degree", std::to_string(d)).options.sh_degree = d;
            add("antialias", "1/255").options.kernel = Footprint::antialias;
        }
        for (const int per : {16, 64, 255, 1024, 4096})
            add("splatting", "1/" + std::to_string(per)).cut_off = 1.0 / per;
        for (const int per : {16, 255, 4096}) {
            Way& way = add("ray", "1/" + std::to_string(per));
            way.options.integrator = Integrator::ray;
            way.cut_off = 1.0 / per;
        }
        for (int samples = 1; samples <= 256; samples *= 2) {
            Way& way = add("march", std::to_string(samples) + (samples == 1 ? " sample" : " samples"));
            way.options.integrator = Integrator::march;
            way.options.samples = samples;
        }
    }
    return ways;
}

/// The host's marcher in float64, with few numbers of samples: it is slow.
report::WorkSeries march_on_host(const Camera& camera, const RenderOptions& options,
                                 const std::vector<Pixel>& pixels, const Exact& exact) {
    const Volume volume(exact.gaussians, camera, options);
    report::WorkSeries marcher{std::string("march on the host, ") + exact.name, true, {}, false, 6};
    const double share = double(camera.width) * camera.height / double(pixels.size());
    constexpr int kSamples[] = {16, 64, 256};
    HostRays rays(pixels, "marched on the host", std::size(kSamples));
    Colors actual;
    for (const int samples : kSamples) {
        report::WorkPoint point;
        point.name = std::to_string(samples) + " samples";
        point.time = 1000 * share *
                     rays.evaluate(actual, [&](double x, double y) { return volume.marched(x, y, samples); });
        const Error error = error_of(exact.colors, actual);
        point.error = error.rms;
        point.worst = error.worst;
        marcher.points.push_back(point);
    }
    return marcher;
}

/// Both exact images of one method have one colour.
report::WorkSeries series_of(const Way& way, const std::vector<Exact>& exact) {
    const char* const methods[] = {"points", "splatting", "ray", "march", "SH degree", "antialias"};
    const std::string method = way.series.substr(0, way.series.rfind(", "));
    const auto found = std::find(std::begin(methods), std::end(methods), method);
    return {way.series,
            true,
            {},
            exact[way.exact].kernel == Footprint::density,
            int(found - std::begin(methods))};
}

/// "ray, density" is measured against the exact image "density".
std::string exact_of(const report::WorkSeries& series) {
    return series.name.substr(series.name.rfind(", ") + 2);
}

}  // namespace

void set_verdicts(std::vector<report::WorkSeries>& all) {
    for (report::WorkSeries& series : all)
        for (report::WorkPoint& point : series.points) {
            point.verdict = "on the front";
            const report::WorkPoint* best = nullptr;
            for (const report::WorkSeries& other : all) {
                if (exact_of(other) != exact_of(series)) continue;
                for (const report::WorkPoint& rival : other.points) {
                    if (!(rival.time < point.time && rival.error < point.error)) continue;
                    if (best && best->error <= rival.error) continue;
                    best = &rival;
                    point.verdict = other.name + ": " + rival.name + " is faster and less wrong";
                }
            }
        }
}

Accuracy measure_accuracy(const std::shared_ptr<gpu::Device>& device, const Gaussians& gaussians,
                          const Camera& camera, const RenderOptions& options) {
    Accuracy result;
    result.threads = host_threads();
    const std::vector<Pixel> pixels = spread_pixels(camera);
    result.pixels = int(pixels.size());
    RenderOptions whole = options;
    whole.sh_degree = kMaxShDegree;
    std::vector<Exact> exact = meanings_of(gaussians);
    {
        HostRays rays(pixels, "integrated in float64", exact.size());
        for (Exact& one : exact) {
            whole.kernel = one.kernel;
            const Volume volume(one.gaussians, camera, whole);
            result.exact_seconds +=
                rays.evaluate(one.colors, [&](double x, double y) { return volume.exact(x, y); });
        }
    }
    for (const Exact& one : exact) {
        whole.kernel = one.kernel;
        result.references.push_back(causes_of(one, camera, whole, pixels));
    }
    {
        const std::vector<Way> ways = ways_of(exact, options, sh_degree_present(gaussians));
        core::Progress progress("rendered", int(ways.size()), "ways", false);
        for (size_t i = 0; i < ways.size(); ++i) {
            const Way& way = ways[i];
            if (result.series.empty() || result.series.back().name != way.series)
                result.series.push_back(series_of(way, exact));
            const Exact& right = exact[way.exact];
            const BenchScene scene{right.gaussians, camera, {}};
            result.series.back().points.push_back(draw(device, scene, way, pixels, right.colors));
            progress.update(int(i + 1), way.series + ", " + way.name);
        }
    }
    whole.kernel = exact.front().kernel;
    result.series.push_back(march_on_host(camera, whole, pixels, exact.front()));
    set_verdicts(result.series);
    return result;
}

}  // namespace ewa::bench
