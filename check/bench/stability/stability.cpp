// SPDX-License-Identifier: Apache-2.0
#include "bench/stability/stability.h"

#include <algorithm>
#include <cfloat>
#include <cmath>
#include <functional>
#include <glm/geometric.hpp>
#include <nlohmann/json.hpp>
#include <numbers>

#include "bench/device_runs.h"
#include "core/json.h"
#include "core/progress.h"
#include "core/random.h"
#include "ewa/error.h"
#include "ewa/renderer.h"
#include "platform/terminal.h"
#include "reference/rays.h"
#include "reference/render.h"
#include "scene/readout.h"
#include "scene/scene_file.h"
#include "shared/constants.h"

namespace ewa::bench {
namespace {

using reference::Raster;
using reference::ReferenceGradient;
using reference::Rendered;
using reference::Values;

constexpr double kUnit = 0x1p-24;       // half a float32 step, relative
constexpr double kPictureFloor = 5e-6;  // of a well-conditioned scene
constexpr double kGradientFloor = 1e-4;
constexpr double kRoundings = 32;      // of a chain of float32 operations on each stored value
constexpr double kAtThreshold = 2e-4;  // relative distance at which float32 may decide differently
constexpr double kPerturbation = 1e-10;
constexpr int kPerturbations = 3;
constexpr double kLargest = FLT_MAX;
constexpr uint64_t kFewPixels = 4, kPixelsEach = 200;  // that may be close to a threshold

/// Moves each stored value by a relative `size`, up or down.
Values perturbed(const Values& values, const glm::dvec3& eye, uint32_t draw, double size) {
    Values out = values;
    uint32_t counter = 0;
    const auto sign = [&] { return core::pcg4d({counter++, draw, 0x636f6e64u, 0})[0] & 1 ? size : -size; };
    const auto relative = [&](std::vector<double>& group) {
        for (double& v : group) v += v * sign();
    };
    const auto absolute = [&](std::vector<double>& group) {
        for (double& v : group) v += std::clamp(std::abs(v), 1.0, 100.0) * sign();
    };
    relative(out.quaternions);
    relative(out.sh);
    absolute(out.log_scales);
    absolute(out.opacity_logits);
    for (size_t i = 0; i < out.size(); ++i) {
        const double s = sign();
        for (size_t k = 0; k < 3; ++k) out.means[3 * i + k] += s * (out.means[3 * i + k] - eye[int(k)]);
    }
    return out;
}

/// Pixels where a decision of the model (1/255, 0.99, the stop) is within kAtThreshold of its threshold.
std::vector<uint8_t> pixels_at_threshold(const Rendered& rendered) {
    const auto whiteners = reference::whiteners_of(rendered.projected);
    const reference::Instances& lists = rendered.instances;
    const int width = lists.grid.image_width, height = lists.grid.image_height;
    std::vector<uint8_t> at(size_t(width) * size_t(height));
    const auto near = [](double value, double threshold) {
        return std::abs(value - threshold) <= kAtThreshold * threshold;
    };
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) {
            const uint32_t tile = lists.grid.tile_of(x, y);
            double transmittance = 1;
            bool hangs = false;
            for (size_t k = lists.first_of_tile[tile]; k < lists.first_of_tile[tile + 1]; ++k) {
                const uint32_t splat = lists.sorted[k].splat;
                const reference::Projected& p = rendered.projected[splat];
                const double sampled =
                    reference::sample(p, whiteners[splat], reference::pixel_centre(x, y)).raw;
                const double raw = p.density ? -std::expm1(-sampled) : sampled;
                const double alpha = raw >= shared::ALPHA_MIN ? std::min(raw, shared::ALPHA_MAX) : 0;
                const double next = transmittance * (1 - alpha);
                // At exactly (1 - ALPHA_MAX)^2 both sides decide equally.
                const bool exact = reference::stops(next) && raw > shared::ALPHA_MAX;
                hangs = hangs || near(raw, shared::ALPHA_MIN) || near(raw, shared::ALPHA_MAX) ||
                        (alpha > 0 && !exact && near(next, shared::TRANSMITTANCE_STOP));
                if (reference::stops(next)) break;
                transmittance = next;
            }
            at[size_t(y) * size_t(width) + size_t(x)] = hangs;
        }
    return at;
}

/// How many contributions are within kAtThreshold of 1/255: the area of a ring of each footprint, at most that of the image.
double expected_at_threshold(const Rendered& rendered) {
    const auto& grid = rendered.instances.grid;
    const double pixels = double(grid.image_width) * double(grid.image_height);
    double sum = 0;
    for (const reference::Projected& p : rendered.projected)
        if (p.visible && p.det > 0)
            sum += 2 * kAtThreshold * std::min(2 * std::numbers::pi * std::sqrt(p.det), pixels);
    return sum;
}

/// A norm for each part of a gradient by the camera.
struct CameraTerms {
    double rotation = 0, shift = 0, focal = 0;
    double readout_turn = 0, readout_shift = 0;
};

/// What the reference computes of a case, and how errors against it are measured.
struct Expected {
    ReferenceGradient reference;
    std::vector<uint8_t> excluded;  // pixels_at_threshold
    double scale = 1;               // of the image's errors
    double least_quaternions = 0;   // see least_quaternion_norm
    bool moves_camera = false;      // there is a gradient by the camera
    bool rolling = false;           // it has no focal length, and that of the readout
    CameraTerms least_camera{};     // of its parts, see least_camera_terms
};

/// The largest error of a pixel that is not excluded. color: an Image or a Raster.
template <class Pixels>
double image_error(const Expected& expected, const Pixels& color) {
    const Raster& right = expected.reference.rendered.blended.color;
    double largest = 0;
    for (int y = 0; y < right.height; ++y)
        for (int x = 0; x < right.width; ++x)
            for (int c = 0; c < 3; ++c) {
                if (expected.excluded[size_t(y) * size_t(right.width) + size_t(x)]) continue;
                const double e = std::abs(double(color.at(x, y)[c]) - right.at(x, y)[c]) / expected.scale;
                if (!(e <= largest)) largest = e;
            }
    return largest;
}

std::vector<double> numbers_of(const glm::dvec3& v) {
    return {v.x, v.y, v.z};
}

/// The errors of image, loss, each group of the gradient and the gradient by the camera, without bounds.
template <class Pixels, class Gradient>
std::vector<Comparison> errors_of(const Expected& expected, const Pixels& color, double loss,
                                  const Gradient& gradient, const CameraMotion& camera) {
    const double right = expected.reference.loss;
    std::vector<Comparison> errors{{"picture", image_error(expected, color)},
                                   {"loss", std::abs(loss - right) / std::max(1.0, right)}};
    for_each_group(gradient, expected.reference.gradient,
                   [&](const std::string& name, const auto& a, const auto& b) {
                       const double least = name == "quaternions" ? expected.least_quaternions : 0;
                       errors.push_back({name, relative_distance(a, b, least)});
                   });
    if (!expected.moves_camera) return errors;
    const CameraMotion& expected_camera = expected.reference.camera;
    const CameraTerms& least = expected.least_camera;
    const auto compare = [&](const char* name, glm::dvec3 CameraMotion::*part, double least_norm) {
        errors.push_back({name, relative_distance(numbers_of(camera.*part), numbers_of(expected_camera.*part),
                                                  least_norm)});
    };
    compare("camera rotation", &CameraMotion::rotation, least.rotation);
    compare("camera shift", &CameraMotion::shift, least.shift);
    if (expected.rolling) {
        compare("readout turn", &CameraMotion::readout_turn, least.readout_turn);
        compare("readout shift", &CameraMotion::readout_shift, least.readout_shift);
        return errors;
    }
    errors.push_back({"focal length", relative_distance(std::vector<double>{camera.log_focal},
                                                        {expected_camera.log_focal}, least.focal)});
    return errors;
}

/// The norm of the values clamped to the range of float32, with squares that cannot overflow.
double norm_of(const std::vector<double>& v) {
    double largest = 0, sum = 0;
    for (const double x : v) largest = std::max(largest, std::min(std::abs(x), kLargest));
    for (const double x : v) sum += largest > 0 ? std::pow(std::min(std::abs(x), kLargest) / largest, 2) : 0;
    return largest * std::sqrt(sum);
}

/// The least norm of the quaternion gradient to measure an error against. It is zero for round splats, which
/// a rotation does not change; then this share of the gradient of the scales replaces it.
double least_quaternion_norm(const StabilityCase& one, const Values& gradient) {
    constexpr double kShare = 1e-3;
    const Values values = one.gaussians;
    double largest = 0;
    for (size_t i = 0; i < values.size(); ++i) {
        const double norm = reference::robust_norm(reference::read_splat(values, i).quaternion);
        if (std::isfinite(norm)) largest = std::max(largest, norm);
    }
    return largest > 0 ? kShare * norm_of(gradient.log_scales) / largest : 0;
}

/// The least norms of the gradient by the camera to measure errors against. It is a sum over all splats, and a splat's share
/// is a sum of torques. Where these cancel, half of the sum of their norms replaces it: each has its own roundings.
CameraTerms least_camera_terms(const StabilityCase& one, const ReferenceGradient& gradient) {
    constexpr double kShare = 0.5;
    const Values values = one.gaussians;
    CameraTerms least;
    for (size_t i = 0; i < values.size(); ++i) {
        if (!gradient.rendered.projected[i].visible) continue;
        const reference::Splat splat = reference::read_splat(values, i);
        CameraMotion term;
        project_backward(splat, one.camera, one.options, gradient.blend.splats[i], &term);
        const double shift = glm::length(term.shift),
                     torque = shift * glm::length(splat.mean - one.camera.position());
        least.rotation += kShare * (glm::length(term.rotation) + torque);
        least.shift += kShare * shift;
        least.focal += kShare * (std::abs(term.log_focal) + torque);
        least.readout_turn += kShare * (glm::length(term.readout_turn) + torque);
        least.readout_shift += kShare * (glm::length(term.readout_shift) + shift);
    }
    return least;
}

bool all_finite(const std::vector<float>& values) {
    return std::all_of(values.begin(), values.end(), [](float x) { return std::isfinite(x); });
}

/// The error of the reference image if each determinant is a c - b^2 in float32, unlike in the pipeline.
double plain_determinant_error(const Expected& expected, const RenderOptions& options) {
    if (options.points || options.integrator != Integrator::splat) return 0;  // no 2D determinant
    const Rendered& rendered = expected.reference.rendered;
    std::vector<reference::Projected> plain = rendered.projected;
    for (reference::Projected& p : plain) {
        const float a = float(p.a), b = float(p.b), c = float(p.c);
        p.det = double(a * c - b * b);
        if (!(p.det > 0)) p.visible = false;  // as renderers do that compute it this way
    }
    const auto order = reference::depth_order(plain);
    const auto lists = reference::make_instances(plain, order, rendered.instances.grid);
    return image_error(expected, reference::blend(plain, lists, options.background).color);
}

Expected expected_of(const StabilityCase& one, const Image& target) {
    Expected expected{reference::loss_gradient(one.gaussians, one.camera, target, one.options), {}};
    const bool on_rays = one.options.integrator != Integrator::splat;
    expected.excluded =
        on_rays ? reference::Rays(one.gaussians, one.camera, one.options).at_threshold(kAtThreshold)
                : pixels_at_threshold(expected.reference.rendered);
    expected.moves_camera = !on_rays && !one.options.points;
    expected.rolling = scene::moves(one.camera);
    if (expected.moves_camera) expected.least_camera = least_camera_terms(one, expected.reference);
    for (const double v : expected.reference.rendered.blended.color.values)
        expected.scale = std::max(expected.scale, std::abs(v));
    expected.least_quaternions = least_quaternion_norm(one, expected.reference.gradient);
    return expected;
}

/// The errors of the reference under changes of each stored value by `size`: the largest of several.
std::vector<double> errors_under_changes(const StabilityCase& one, const Image& target,
                                         const Expected& expected, double size) {
    std::vector<double> largest;
    for (uint32_t draw = 0; draw < kPerturbations; ++draw) {
        const ReferenceGradient moved = reference::loss_gradient(
            perturbed(one.gaussians, one.camera.position(), draw, size), one.camera, target, one.options);
        const auto errors =
            errors_of(expected, moved.rendered.blended.color, moved.loss, moved.gradient, moved.camera);
        largest.resize(errors.size());
        for (size_t i = 0; i < errors.size(); ++i) largest[i] = std::max(largest[i], errors[i].error);
    }
    return largest;
}

/// Without a finite condition number, the floor is the bound.
double bound(double floor, double condition) {
    return std::isfinite(condition) ? std::max(floor, kRoundings * condition * kUnit) : floor;
}

void add_bounds(const StabilityCase& one, const Image& target, const Expected& expected,
                std::vector<Comparison>& comparisons) {
    const std::vector<double> errors = errors_under_changes(one, target, expected, kPerturbation);
    for (size_t i = 0; i < errors.size(); ++i) {
        comparisons[i].condition = errors[i] / kPerturbation;
        comparisons[i].bound = bound(i < 2 ? kPictureFloor : kGradientFloor, comparisons[i].condition);
    }
    if (std::ranges::all_of(comparisons, &Comparison::good)) return;
    // Changes as large as the roundings cross thresholds of the model, where the smaller ones do not.
    const std::vector<double> crossing = errors_under_changes(one, target, expected, kRoundings * kUnit);
    for (size_t i = 0; i < crossing.size(); ++i)
        if (std::isfinite(crossing[i])) comparisons[i].bound = std::max(comparisons[i].bound, crossing[i]);
}

/// The comparison that is closest to its bound.
const Comparison& tightest(const StabilityResult& result) {
    return *std::max_element(result.comparisons.begin() + 1, result.comparisons.end(),
                             [](const Comparison& a, const Comparison& b) {
                                 return a.good() && (!b.good() || a.error / a.bound < b.error / b.bound);
                             });
}

std::string stability_header(size_t cases) {
    std::string text = text_of(
        "%zu scenes. Each is rendered and differentiated on the device, and by the float64 reference.\n\n"
        "splats, drawn, skip  in the scene; in the image; skipped, since a value is not finite\n"
        "picture, bound       the largest error of the image, relative to its largest value, and the limit\n"
        "condition            how much an error of the input grows in the image, whatever computes it\n"
        "plain det            the image's error with the textbook determinant a c - b^2 in float32\n"
        "worst of rest        of the loss and the gradients, the one nearest to its limit\n"
        "error ... condition  of that one, relative to its norm\n"
        "verdict              ok: all is finite and within its limit; or what is not\n\n",
        cases);
    text += text_of("%-24s %6s %6s %5s | %8s %8s %9s %9s | %-14s %8s %8s %9s | %s\n", "case", "splats",
                    "drawn", "skip", "picture", "bound", "condition", "plain det", "worst of rest", "error",
                    "bound", "condition", "verdict");
    return text;
}

std::string stability_line(const StabilityResult& r) {
    const Comparison &image = r.comparisons.front(), &worst = tightest(r);
    std::string line =
        text_of("%-24s %6u %6u %5u | %8.1e %8.1e %9.1e %9.1e | %-14s %8.1e %8.1e %9.1e", r.name.c_str(),
                r.splats, r.drawn, r.skipped, image.error, image.bound, image.condition, r.plain_determinant,
                worst.of.c_str(), worst.error, worst.bound, worst.condition);
    line += " | ";
    line += r.verdict();
    return line;
}

std::string stability_training_header() {
    return text_of(
        "\nTraining from each scene with Adam.\n"
        "loss, to          before the first step and after the last\n"
        "skipped           splats with a value that is not finite, in the last step\n"
        "dropped, limited  updates that were not finite, and updates that were shortened\n"
        "verdict           ok: all that was finite still is\n\n"
        "%-24s %6s %10s %10s %8s %8s %8s | %s\n",
        "training from", "steps", "loss", "to", "skipped", "dropped", "limited", "verdict");
}

std::string stability_training_line(const StabilityTraining& t) {
    return text_of("%-24s %6d %10.3g %10.3g %8u %8llu %8llu | %s", t.name.c_str(), t.steps, t.first_loss,
                   t.last_loss, t.skipped, static_cast<unsigned long long>(t.dropped_updates),
                   static_cast<unsigned long long>(t.limited_steps), t.good() ? "ok" : "NOT FINITE");
}

/// Whether all values that were finite still are.
bool stayed_finite(const std::vector<float>& before, const std::vector<float>& after) {
    for (size_t i = 0; i < before.size(); ++i)
        if (std::isfinite(before[i]) && !std::isfinite(after[i])) return false;
    return before.size() == after.size();
}

std::vector<StabilityCase> chosen_cases(const Options& options) {
    if (!options.scene.empty()) {
        const Gaussians gaussians = scene::read_scene_file(options.scene).gaussians;
        if (gaussians.size() == 0) throw InputError(options.scene.string() + ": has no splats");
        return {stability_case_of(options.scene.filename().string(), gaussians)};
    }
    std::vector<StabilityCase> chosen;
    for (StabilityCase& one : stability_cases())
        if (options.cases.empty() || name_matches(one.name, options.cases)) chosen.push_back(std::move(one));
    if (chosen.empty()) throw InputError("no stability case matches '" + options.cases + "'");
    return chosen;
}

}  // namespace

void to_json(Json& json, const Comparison& c) {
    json = {
        {"of", c.of}, {"error", c.error}, {"bound", c.bound}, {"condition", c.condition}, {"good", c.good()}};
}

void to_json(Json& json, const StabilityResult& r) {
    json = {{"name", r.name},
            {"what", r.what},
            {"splats", r.splats},
            {"drawn", r.drawn},
            {"skipped", r.skipped},
            {"skipped_by_twin", r.skipped_by_reference},
            {"pixels_at_threshold", r.pixels_at_threshold},
            {"finite", r.finite},
            {"plain_determinant_error", r.plain_determinant},
            {"good", r.good()},
            {"comparisons", r.comparisons}};
}

void to_json(Json& json, const StabilityTraining& t) {
    json = {{"name", t.name},
            {"steps", t.steps},
            {"first_loss", t.first_loss},
            {"last_loss", t.last_loss},
            {"skipped", t.skipped},
            {"dropped_updates", t.dropped_updates},
            {"limited_steps", t.limited_steps},
            {"finite", t.finite}};
}

bool StabilityResult::too_many_at_threshold() const {
    const auto expected = uint64_t(2 * expected_at_threshold);
    return pixels_at_threshold > std::max({kFewPixels, pixels / kPixelsEach, expected});
}

std::string StabilityResult::verdict() const {
    if (good()) return "ok";
    std::vector<std::string> faults;
    if (!finite) faults.emplace_back("NOT FINITE");
    if (skipped != skipped_by_reference)
        faults.push_back(text_of("SKIPPED, the reference %u", skipped_by_reference));
    if (too_many_at_threshold())
        faults.push_back(
            text_of("%llu PIXELS AT A THRESHOLD", static_cast<unsigned long long>(pixels_at_threshold)));
    for (const Comparison& c : comparisons)
        if (!c.good()) faults.push_back("WRONG " + c.of);
    std::string text;
    for (const std::string& fault : faults) text += (text.empty() ? "" : ", ") + fault;
    return text;
}

bool StabilityResult::good() const {
    return finite && skipped == skipped_by_reference && !too_many_at_threshold() &&
           std::all_of(comparisons.begin(), comparisons.end(), std::mem_fn(&Comparison::good));
}

StabilityResult compare_with_reference(const std::shared_ptr<gpu::Device>& device, const StabilityCase& one,
                                       const Gaussians* drawn) {
    const Image target = stability_target(one.camera.width, one.camera.height);
    const Expected expected = expected_of(one, target);
    const std::vector<uint8_t>& excluded = expected.excluded;

    StabilityResult result;
    result.name = one.name;
    result.what = one.what;
    result.splats = uint32_t(one.gaussians.size());
    const auto& projected = expected.reference.rendered.projected;
    result.drawn = uint32_t(
        std::count_if(projected.begin(), projected.end(), [](const auto& each) { return each.visible; }));
    result.skipped_by_reference = expected.reference.rendered.skipped_nonfinite;
    result.pixels = excluded.size();
    result.pixels_at_threshold = uint64_t(std::count(excluded.begin(), excluded.end(), 1));
    result.expected_at_threshold = expected_at_threshold(expected.reference.rendered);
    result.plain_determinant = plain_determinant_error(expected, one.options);

    if (!drawn) drawn = &one.gaussians;
    Renderer renderer(device, *drawn, one.options);
    const Image color = renderer.render(one.camera).color;
    result.skipped = renderer.skipped_nonfinite();
    const LossGradient actual = loss_gradient(device, *drawn, one.camera, target, one.options);
    result.loss = actual.loss;
    result.finite = all_finite(color.pixels) && std::isfinite(actual.loss);
    for_each_group(actual.gradient, actual.gradient, [&](const char*, const auto& group, const auto&) {
        result.finite = result.finite && all_finite(group);
    });
    result.comparisons = errors_of(expected, color, actual.loss, actual.gradient, actual.camera);
    add_bounds(one, target, expected, result.comparisons);
    return result;
}

bool trains(const StabilityCase& one) {
    return one.options.integrator == Integrator::splat;
}

StabilityTraining train_from(const std::shared_ptr<gpu::Device>& device, const StabilityCase& one,
                             int steps) {
    StabilityTraining result;
    result.name = one.name;
    result.steps = steps;
    // The first run changes nothing: its rates are zero.
    FrameRun run(device, {one.gaussians, one.camera, stability_target(one.camera.width, one.camera.height)},
                 true, one.options);
    result.first_loss = pipeline::loss_of({}, run.counts());
    for (uint32_t step = 1; step <= uint32_t(steps); ++step) {
        // The rates of 3DGS for a scene of unit extent.
        run.set_rates({.mean = 1.6e-4f,
                       .opacity = 0.025f,
                       .quaternion = 1e-3f,
                       .scale = 5e-3f,
                       .sh0 = 2.5e-3f,
                       .sh_rest = 1.25e-4f,
                       .step = step});
        run.run();
        result.last_loss = pipeline::loss_of({}, run.counts());
        result.finite = result.finite && std::isfinite(result.last_loss);
        result.dropped_updates += run.counts().dropped_updates;
        result.limited_steps += run.counts().limited_steps;
    }
    result.skipped = run.counts().skipped_nonfinite;
    const Gaussians end = pipeline::download_model(run.model(), run.model().params);
    for_each_group(one.gaussians, end, [&](const char*, const auto& before, const auto& after) {
        result.finite = result.finite && stayed_finite(before, after);
    });
    const auto planes = run.frame().planes.download<float>(run.frame().sizes.planes / 4);
    result.finite = result.finite && all_finite(planes);
    return result;
}

int run_stability(const Options& options) {
    const std::vector<StabilityCase> cases = chosen_cases(options);
    const auto device = open_device({.selector = options.device});
    print("device: " + device_info(*device).name + "\n" + stability_header(cases.size()));
    std::vector<StabilityResult> results;
    std::vector<StabilityTraining> trainings;
    // In a file, the rows alone tell how far it is.
    const bool rows_alone = !platform::is_terminal(platform::Stream::output);
    {
        core::Progress progress("compared", int(cases.size()), "scenes", rows_alone);
        for (const StabilityCase& one : cases) {
            results.push_back(compare_with_reference(device, one));
            progress.clear();
            print(stability_line(results.back()) + "\n");
            progress.update(int(results.size()));
        }
    }
    if (options.training_steps > 0) print(stability_training_header());
    {
        core::Progress progress("trained from", int(std::count_if(cases.begin(), cases.end(), trains)),
                                "scenes", rows_alone);
        for (const StabilityCase& one : cases) {
            if (options.training_steps == 0) break;
            if (!trains(one)) continue;
            trainings.push_back(train_from(device, one, options.training_steps));
            progress.clear();
            print(stability_training_line(trainings.back()) + "\n");
            progress.update(int(trainings.size()));
        }
    }
    if (!options.json.empty())
        core::write_json(options.json,
                         {{"schema", "ewa-stability-1"}, {"cases", results}, {"training", trainings}});
    const auto wrong =
        std::count_if(results.begin(), results.end(), [](const StabilityResult& r) { return !r.good(); }) +
        std::count_if(trainings.begin(), trainings.end(),
                      [](const StabilityTraining& t) { return !t.good(); });
    print(wrong == 0
              ? text_of("\nall %zu results are within their bounds\n", results.size() + trainings.size())
              : text_of("\n%td of %zu results are not within their bounds\n", wrong,
                        results.size() + trainings.size()));
    return wrong == 0 ? 0 : 1;
}

}  // namespace ewa::bench
