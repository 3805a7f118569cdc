// SPDX-License-Identifier: Apache-2.0
#include "capture/lens_refinement.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "capture/lens_check.h"
#include "core/random.h"
#include "ewa/error.h"

namespace ewa::capture {
namespace {

namespace fs = std::filesystem;

constexpr int32_t kSimpleRadial = 2, kRadial = 3, kOpenCv = 4;  // COLMAP's numbers
constexpr int kPhotosOfALens = 10;      // that determine four terms of distortion; or all photos
constexpr uint32_t kHeldOutOf = 10;     // of the observations one is held out
constexpr size_t kLeastTrack = 3;       // observations that a point keeps
constexpr double kMostPixelError = 16;  // px; a mismatch says nothing of a lens
constexpr size_t kLeastHeldOut = 50;
constexpr double kChance = 2;  // standard errors

/// Whether this observation is held out.
bool is_held_out(uint32_t image, uint32_t feature) {
    return core::pcg4d({image, feature, 0, 0})[0] % kHeldOutOf == 0;
}

/// Moves cameras, points and lenses of a model to the least errors. solver: Colmap::options_of_solver().
SparseModel adjusted(const Colmap& colmap, const std::string& solver, const SparseModel& model,
                     const fs::path& work, int step) {
    constexpr int kSteps = 4;
    const fs::path from = work / "adjusted_from", to = work / "adjusted";
    for (const fs::path& folder : {from, to}) {
        fs::remove_all(folder);
        fs::create_directories(folder);
    }
    write_sparse(model, from);
    colmap.run({"colmap", "bundle_adjuster", "--input_path", argument(from), "--output_path", argument(to),
                solver + "max_num_iterations", "40", solver + "function_tolerance", "1e-6"},
               {CapturePhase::cameras, "adjusted", "times", step, kSteps, {}},
               [](const std::string&) { return std::nullopt; });
    return read_sparse(to);
}

/// Whether the lenses are those of cameras, as far as they were before.
bool stays_sound(const SparseModel& before, const SparseModel& after,
                 const std::map<std::string, double>& expected) {
    return grade_of(after, expected).sound >= grade_of(before, expected).sound &&
           after.images.size() == before.images.size();
}

}  // namespace

std::vector<HeldOut> hold_out(SparseModel& model) {
    std::vector<HeldOut> taken;
    for (auto& [id, point] : model.points) {
        auto& track = point.track;
        size_t kept = track.size();
        std::erase_if(track, [&, id = id](const std::pair<uint32_t, uint32_t>& entry) {
            if (kept <= kLeastTrack || !is_held_out(entry.first, entry.second)) return false;
            --kept;
            taken.push_back({entry.first, entry.second, id});
            model.images.at(entry.first).features[entry.second].point = kNoPoint;
            return true;
        });
    }
    return taken;
}

std::vector<double> errors_of(const SparseModel& adjusted, const std::vector<HeldOut>& observations) {
    std::map<uint32_t, Camera> cameras;
    for (const auto& [id, image] : adjusted.images) cameras[id] = camera_of(adjusted, image);
    std::vector<double> errors;
    for (const HeldOut& each : observations) {
        const auto camera = cameras.find(each.image);
        const auto point = adjusted.points.find(each.point);
        double error = kMostPixelError;
        if (camera != cameras.end() && point != adjusted.points.end())
            error = reprojection_error(camera->second, point->second.position,
                                       adjusted.images.at(each.image).features[each.feature].at);
        errors.push_back(std::isfinite(error) ? std::min(error, kMostPixelError) : kMostPixelError);
    }
    return errors;
}

bool have_fallen(const std::vector<double>& before, const std::vector<double>& after) {
    const size_t count = std::min(before.size(), after.size());
    if (count < kLeastHeldOut) return false;
    double sum = 0, squares = 0;
    for (size_t i = 0; i < count; ++i) {
        const double fall = before[i] - after[i];
        sum += fall;
        squares += fall * fall;
    }
    const double mean = sum / double(count), variance = squares / double(count) - mean * mean;
    return mean > kChance * std::sqrt(std::max(variance, 0.0) / double(count)) && mean > 0;
}

int give_lens(SparseModel& model, int32_t lens) {
    std::map<uint32_t, int> photos;
    for (const auto& [id, image] : model.images) ++photos[image.camera];
    int given = 0;
    for (auto& [id, camera] : model.cameras) {
        const bool enough = photos[id] >= kPhotosOfALens || size_t(photos[id]) == model.images.size();
        if (camera.lens != kSimpleRadial || !enough) continue;
        const double focal = camera.parameters[0], x = camera.parameters[1], y = camera.parameters[2],
                     k = camera.parameters[3];
        camera.lens = lens;
        camera.parameters = lens == kOpenCv ? std::vector<double>{focal, focal, x, y, k, 0, 0, 0}
                                            : std::vector<double>{focal, x, y, k, 0};
        ++given;
    }
    return given;
}

std::string refine_lens(const Colmap& colmap, const fs::path& folder,
                        const std::map<std::string, double>& expected, const fs::path& work) {
    const SparseModel whole = read_sparse(folder);
    SparseModel part = whole;
    const std::vector<HeldOut> observations = hold_out(part);
    if (observations.size() < kLeastHeldOut) return {};
    if (SparseModel trial = whole; give_lens(trial, kOpenCv) == 0) return {};
    int step = 0;
    const std::string solver = colmap.options_of_solver();
    const SparseModel simple = adjusted(colmap, solver, part, work, step++);
    const std::vector<double> before = errors_of(simple, observations);
    const std::array kLenses{std::pair(kOpenCv, "OPENCV"), std::pair(kRadial, "RADIAL")};
    for (const auto& [lens, name] : kLenses) {
        SparseModel freed = simple;
        give_lens(freed, lens);
        freed = adjusted(colmap, solver, freed, work, step++);
        // Photos that do not determine a whole lens bend it; a part of its terms would hide that.
        if (!stays_sound(whole, freed, expected)) return {};
        if (!have_fallen(before, errors_of(freed, observations))) continue;
        SparseModel result = whole;
        give_lens(result, lens);
        result = adjusted(colmap, solver, result, work, step++);
        if (!stays_sound(whole, result, expected)) continue;
        write_sparse(result, folder);
        return name;
    }
    return {};
}

}  // namespace ewa::capture
