// SPDX-License-Identifier: Apache-2.0
// The first splats of a run.
#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>
#include <glm/matrix.hpp>
#include <numbers>

#include "core/random.h"
#include "core/typing.h"
#include "ewa/error.h"
#include "ewa/splat_edit.h"
#include "ewa/splat_files.h"
#include "io/datasets/image_records.h"
#include "prepare/depth_points.h"
#include "prepare/stereo_points.h"
#include "run/region_option.h"
#include "run/run_input.h"
#include "scene/dense_points.h"
#include "scene/thin_points.h"
#include "shared/constants.h"
#include "train/needs.h"
#include "train/schedule.h"

namespace ewa::train {
namespace {

constexpr uint32_t kRandomSplats = 50000;
/// So many points are taken as they are, however small the photos.
constexpr size_t kUsualPoints = 200000;
constexpr const char* kOtherLimit = "; --max-splats N sets another limit";
// A longer run adds splats by itself where they are needed. fox_270 gains 0.7 dB in 500 steps, and nothing in 1,000.
constexpr int kDenseStartSteps = 700;
// With so few points for each pixel of a photo, runs of 1,000 steps gain from it, too (docs/experiments/short_runs.md).
constexpr int kDenseStartStepsOfFewPoints = 1000;
constexpr double kFewPoints = 0.15;
constexpr double kPixelsOfDenseStart = 2;  // of an image, for each first splat

/// Four numbers of (0, 1) for each seed, splat and use of it.
std::array<double, 4> uniform(uint64_t seed, uint32_t index, uint32_t use) {
    return core::uniform4({static_cast<uint32_t>(seed), static_cast<uint32_t>(seed >> 32), index, use});
}

glm::dvec3 point_in_sphere(const Sphere& sphere, const std::array<double, 4>& u) {
    const double z = 2 * u[0] - 1;
    const double angle = 2 * std::numbers::pi * u[1];
    const double radius = sphere.radius * std::cbrt(u[2]);
    const double flat = std::sqrt(1 - z * z);
    return sphere.center + radius * glm::dvec3(flat * std::cos(angle), flat * std::sin(angle), z);
}

bool sees(const Camera& camera, const glm::dvec3& point) {
    const glm::dvec3 p = camera.rotation * point + camera.translation;
    if (!(p.z > 0)) return false;
    const double x = camera.fx * p.x / p.z + camera.cx, y = camera.fy * p.y / p.z + camera.cy;
    return x >= 0 && x <= camera.width && y >= 0 && y <= camera.height;
}

glm::dvec3 point_on_a_ray(const Camera& camera, double depth, const std::array<double, 4>& u) {
    const glm::dvec3 ray((u[0] * camera.width - camera.cx) / camera.fx,
                         (u[1] * camera.height - camera.cy) / camera.fy, 1);
    return camera.position() + glm::transpose(camera.rotation) * (depth * u[2] * glm::normalize(ray));
}

/// A point of the sphere that at least one camera sees.
glm::dvec3 seen_point(const Dataset& dataset, const std::vector<int>& frames, const Sphere& sphere,
                      uint64_t seed, uint32_t index) {
    // The frustums of a forward-facing capture fill a few hundredths of the sphere.
    constexpr uint32_t kAttempts = 64;
    for (uint32_t attempt = 0; attempt < kAttempts; ++attempt) {
        const glm::dvec3 point = point_in_sphere(sphere, uniform(seed, index, 2 * attempt));
        if (std::any_of(frames.begin(), frames.end(),
                        [&](int i) { return sees(dataset.frames[size_t(i)].camera, point); }))
            return point;
    }
    const auto u = uniform(seed, index, 2 * kAttempts);
    const auto which = std::min(size_t(u[3] * double(frames.size())), frames.size() - 1);
    return point_on_a_ray(dataset.frames[size_t(frames[which])].camera, sphere.radius, u);
}

/// Spheres have no opacity. In other drawings they are as opaque as a sphere is in its middle.
void make_opaque(Gaussians& splats) {
    const double logit = std::log(shared::ALPHA_MAX / (1 - shared::ALPHA_MAX));
    std::fill(splats.opacity_logits.begin(), splats.opacity_logits.end(), float(logit));
}

/// Opacity and scale of the first splats as the options ask for. They come from points, with opacity 0.1 and the
/// distance to their neighbours.
void adjust_start(const RunOptions& options, Gaussians& start) {
    const RunOptions usual;
    if (!has_opacities(options.train)) {
        // The radius is the distance to the neighbours.
        for (float& scale : start.log_scales) scale -= float(std::log(shared::ELLIPSOID_REACH));
        make_opaque(start);
    }
    if (options.init_opacity != usual.init_opacity) {
        const double logit = std::log(options.init_opacity / (1 - options.init_opacity));
        std::fill(start.opacity_logits.begin(), start.opacity_logits.end(), float(logit));
    }
    if (options.init_scale != usual.init_scale)
        for (float& scale : start.log_scales) scale = float(double(scale) + std::log(options.init_scale));
}

}  // namespace

Gaussians random_gaussians(const Dataset& dataset, const std::vector<int>& frames, int count, uint64_t seed,
                           int sh_degree) {
    const Sphere sphere = viewed_sphere(dataset, frames);
    PointCloud points;
    for (int i = 0; i < count; ++i) {
        const auto index = static_cast<uint32_t>(i);
        points.positions.push_back(seen_point(dataset, frames, sphere, seed, index));
        const auto shade = uniform(seed, index, 1);
        std::array<uint8_t, 3> color;
        for (size_t c = 0; c < 3; ++c) color[c] = static_cast<uint8_t>(96 + 64 * shade[c]);
        points.colors.push_back(color);
    }
    return gaussians_from_points(points, sh_degree);
}

namespace {

/// How many first splats there should be, or 0 if the points are to be taken as they are.
/// points: those that the run starts from.
size_t dense_start_size(const RunOptions& options, const Dataset& dataset, const std::vector<int>& frames,
                        size_t points) {
    const TrainOptions& train = options.train;
    if (options.dense_start == DenseStart::off) return 0;
    const double pixels = pixels_of(dataset, frames) / double(frames.size());
    const bool few = double(points) < kFewPoints * pixels && !few_photos(train, frames.size());
    const int most_steps = few ? kDenseStartStepsOfFewPoints : kDenseStartSteps;
    if (options.dense_start == DenseStart::automatic &&
        (train.strategy != Strategy::adc || train.steps > most_steps || !has_opacities(train)))
        return 0;
    const auto wanted = size_t(pixels / kPixelsOfDenseStart);
    return train.max_splats == kAutomaticMaxSplats ? wanted : std::min(wanted, size_t(train.max_splats));
}

/// How many first splats there are where no points say so.
uint32_t first_splats(const RunOptions& options) {
    const uint32_t most = options.train.max_splats;
    return most == kAutomaticMaxSplats ? kRandomSplats : std::min(kRandomSplats, most);
}

void refuse_dense_start(const RunOptions& options, const std::string& start) {
    if (options.dense_start == DenseStart::on)
        throw InputError("--dense-start on puts splats between points, and " + start + " has none");
}

/// How many points training starts from at the most.
size_t most_points(const RunOptions& options, const Dataset& dataset, const std::vector<int>& frames) {
    if (options.train.max_splats != kAutomaticMaxSplats) return options.train.max_splats;
    return std::max<size_t>(kUsualPoints, cap_by_pixels(dataset, frames));
}

std::string thinned_note(size_t taken, size_t all, const RunOptions& options) {
    std::string note = fmt::format("{} of {} points are taken, evenly", taken, all);
    if (options.train.max_splats == kAutomaticMaxSplats)
        note.append(": the photos have detail for no more").append(kOtherLimit);
    return note;
}

Gaussians splats_of(const PointCloud& points, const RunOptions& options, const Dataset& dataset,
                    const std::vector<int>& frames) {
    const size_t wanted = dense_start_size(options, dataset, frames, points.positions.size());
    if (wanted <= points.positions.size()) return gaussians_from_points(points, options.train.sh_degree);
    return gaussians_from_points(
        scene::with_midpoints(points, wanted,
                              [&](const glm::dvec3& point) { return in_region(options.train, point); }),
        options.train.sh_degree);
}

/// Splats that keep their own opacities and scales.
Gaussians splats_of_file(const RunOptions& options, const std::filesystem::path& file) {
    refuse_dense_start(options, options.init);
    Gaussians start = load_splats(file);
    set_sh_degree(start, options.train.sh_degree);
    if (!has_opacities(options.train)) make_opaque(start);
    const RunOptions usual;
    if (options.init_opacity != usual.init_opacity || options.init_scale != usual.init_scale)
        throw InputError("--init-opacity and --init-scale are for first splats without their own; " +
                         options.init + " is a splat file");
    check_start(start.size(), options.train);
    return start;
}

}  // namespace

Gaussians initial_splats(const RunOptions& options, const Dataset& dataset, const std::vector<int>& frames,
                         StartSource* source) {
    StartSource unused;
    StartSource& found = source ? *source : unused;
    found = {};
    StartsFrom& from = found.from;
    from = options.init == "random" ? StartsFrom::random : StartsFrom::file;
    const int degree = options.train.sh_degree;
    const std::filesystem::path file = options.init_folder / options.init;
    Gaussians start;
    if (options.init == "sfm") {
        PointCloud measured;
        if (dataset.points.positions.empty())
            measured = points_of_depth_maps(dataset, frames, first_splats(options), options.train.seed);
        from = measured.positions.empty() ? StartsFrom::points : StartsFrom::depth_maps;
        const PointCloud& points = measured.positions.empty() ? dataset.points : measured;
        const size_t all = points.positions.size(), most = most_points(options, dataset, frames);
        if (all > most) found.thinned = thinned_note(most, all, options);
        if (all > 0) start = splats_of(scene::thinned(points, most), options, dataset, frames);
    }
    const bool chosen = options.init == "stereo";
    if (chosen || (options.init == "sfm" && start.size() == 0)) {
        const auto [points, images] = points_by_stereo(dataset, frames, options.train.render.background,
                                                       first_splats(options), options.train.seed);
        found.points = points.positions.size();
        found.images = images;
        // Random splats fill any region. Points may all lie outside.
        const bool enough = std::ranges::any_of(
            points.positions, [&](const glm::dvec3& point) { return in_region(options.train, point); });
        if (chosen && points.positions.empty())
            throw InputError(
                "--init stereo: the images agree on too few depths; --init random starts without");
        from = chosen || enough ? StartsFrom::stereo : StartsFrom::random;
        if (from == StartsFrom::stereo) start = splats_of(points, options, dataset, frames);
    }
    if (from == StartsFrom::random) {
        refuse_dense_start(options, options.init == "random" ? "--init random" : "the dataset");
        start = random_gaussians(dataset, frames, int(first_splats(options)), options.train.seed, degree);
    } else if (from == StartsFrom::file && io::is_point_cloud(file)) {
        const size_t most = most_points(options, dataset, frames);
        const io::PlyPoints cloud = io::read_points_ply(file, most);
        if (cloud.dropped.count > 0)
            found.skipped = fmt::format("{} of {} skipped, since a coordinate is not finite: {}",
                                        core::counted(uint64_t(cloud.dropped.count), "point"), options.init,
                                        cloud.dropped.first);
        found.cloud = true;
        if (cloud.found > most) found.thinned = thinned_note(most, cloud.found, options);
        start = splats_of(cloud.points, options, dataset, frames);
    } else if (from == StartsFrom::file) {
        return splats_of_file(options, file);
    }
    adjust_start(options, start);
    check_start(start.size(), options.train);
    return start;
}

void check_without_dataset(const RunOptions& options) {
    if (options.test_every == 1)
        throw InputError("--test-every 1 holds every image out; none is left to train on");
    if (options.init == "random")
        refuse_dense_start(options, "--init random");
    else if (!starts_by_word(options.init) && !io::is_point_cloud(options.init))
        initial_splats(options, {}, {});
}

bool thin_for_device(RunInput& input, Needs& needs) {
    const TrainOptions& train = input.options.train;
    if (!input.from_points || train.max_splats != kAutomaticMaxSplats || train.device_memory_bytes > 0 ||
        input.options.ranks->size() > 1)
        return false;
    const size_t fit = needs.fitting_start();
    if (fit >= input.start.size()) return false;
    RunOptions fewer = input.options;
    fewer.train.max_splats = uint32_t(fit);
    StartSource source;
    input.start = initial_splats(fewer, input.dataset, input.split.train, &source);
    std::erase_if(input.notes, [](const std::string& note) { return note.ends_with(kOtherLimit); });
    if (!source.thinned.empty())
        input.notes.push_back(source.thinned + ": the device's memory has room for no more" + kOtherLimit);
    return true;
}

}  // namespace ewa::train
