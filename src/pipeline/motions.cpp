// SPDX-License-Identifier: Apache-2.0
#include "pipeline/motions.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <optional>

#include "passes/passes.h"
#include "pipeline/adam.h"
#include "pipeline/model.h"
#include "scene/native_lens.h"
#include "scene/readout.h"

namespace ewa::pipeline {
namespace {

constexpr uint32_t kRows = shared::MOTION_VALUES;

// Weight of the regulariser, for a motion of one radian, one scene extent, or a factor of e. It is far below the gradient of
// the loss, and matters where that is zero: cameras and splats that move together.
constexpr float kMotionPull = 1e-2f;

// Adam's decays. A camera is stepped once in as many steps as there are images, some dozen times in a short run. The gradients
// of the first ones, from unfinished splats, must not count any more in the last ones.
constexpr double kBeta1 = 0.5, kBeta2 = 0.9;

constexpr size_t kFocalRow = 3;
constexpr size_t kBasisPoints = 2000;  // that the camera sees, at most
// Shares of A's diagonal that are added to it: for directions along which the points say nothing.
constexpr double kDamping = 1e-2;

/// The derivative of a point's direction in the image, x / z or y / z times the factor of the focal length, by a motion.
/// row: 0 or 1. p: camera coordinates.
std::array<double, kRows> image_derivative(const glm::dvec3& p, int row) {
    const double u = p.x / p.z, v = p.y / p.z;
    // A rotation w moves p by w x p, and a shift s by -s.
    if (row == 0) return {-u * v, 1 + u * u, -v, u, -1 / p.z, 0, u / p.z};
    return {-1 - v * v, u * v, u, v, 0, -1 / p.z, v / p.z};
}

using Derivative = std::array<std::array<double, kRows>, 2>;

/// The same through a lens, by central differences. Empty where the lens does not show the point.
std::optional<Derivative> lens_derivative(const Camera& camera, double limit, const glm::dvec3& p) {
    const glm::dvec2 focal(camera.fx, camera.fy), center(camera.cx, camera.cy),
        size(camera.width, camera.height);
    const auto pixel = scene::pixel_of(camera, limit, p);
    if (!pixel || pixel->x < 0 || pixel->y < 0 || pixel->x >= size.x || pixel->y >= size.y)
        return std::nullopt;
    const glm::dvec2 here = (*pixel - center) / focal;
    glm::dvec3 rows[2];
    for (int k = 0; k < 3; ++k) {
        glm::dvec3 step(0);
        step[k] = 1e-5 * glm::length(p);
        const auto after = scene::pixel_of(camera, limit, p + step);
        const auto before = scene::pixel_of(camera, limit, p - step);
        if (!after || !before) return std::nullopt;
        const glm::dvec2 slope = (*after - *before) / focal / (2 * step[k]);
        // Across the seam of 360 degrees the image jumps.
        if (std::abs(after->x - before->x) > 0.5 * size.x) return std::nullopt;
        for (int r = 0; r < 2; ++r) rows[r][k] = slope[r];
    }
    Derivative out;
    for (size_t r = 0; r < 2; ++r) {
        const glm::dvec3 by_turn = glm::cross(p, rows[r]);
        out[r] = {by_turn.x, by_turn.y, by_turn.z, here[int(r)], -rows[r].x, -rows[r].y, -rows[r].z};
    }
    return out;
}

/// By the camera's lens. Empty where the camera does not see the point.
std::optional<Derivative> seen_derivative(const Camera& camera, double limit, const glm::dvec3& p) {
    if (!camera.distortion.none()) return lens_derivative(camera, limit, p);
    if (!(p.z > shared::NEAR_PLANE)) return std::nullopt;
    const double x = camera.fx * p.x / p.z + camera.cx, y = camera.fy * p.y / p.z + camera.cy;
    if (!(x >= 0 && x < camera.width && y >= 0 && y < camera.height)) return std::nullopt;
    return Derivative{image_derivative(p, 0), image_derivative(p, 1)};
}

using Matrix = std::array<std::array<double, kRows>, kRows>;

/// The derivative by the motion during the readout, at the time of the point's row.
Derivative at_time(const Camera& camera, const scene::ReadoutMotion& motion, Derivative d) {
    const double x = camera.fx * d[0][kFocalRow] + camera.cx, y = camera.fy * d[1][kFocalRow] + camera.cy;
    const double time = motion.first + motion.slope.x * x + motion.slope.y * y;
    for (auto& row : d)
        for (double& value : row) value *= time;
    return d;
}

/// Adds J^T J of the points that the camera sees. Returns their number.
size_t add_points(Matrix& a, const Camera& moving, const Gaussians& gaussians, bool readout) {
    const Camera camera = scene::at_middle(moving);
    const scene::ReadoutMotion motion = scene::middle_motion(moving);
    const double limit = scene::lens_limit(camera);
    std::vector<Derivative> seen;
    for (size_t i = 0; i < gaussians.size(); ++i)
        if (const auto d = seen_derivative(camera, limit,
                                           camera.rotation * gaussians.world_mean(i) + camera.translation))
            seen.push_back(readout ? at_time(camera, motion, *d) : *d);
    const size_t stride = seen.size() / kBasisPoints + 1;
    size_t points = 0;
    for (size_t i = 0; i < seen.size(); i += stride, ++points)
        for (const auto& j : seen[i])
            for (size_t r = 0; r < kRows; ++r)
                for (size_t c = 0; c < kRows; ++c) a[r][c] += j[r] * j[c];
    return points;
}

/// L with L L^T = a (Cholesky), in place of the lower triangle.
void factorise(Matrix& a) {
    for (size_t c = 0; c < kRows; ++c) {
        for (size_t k = 0; k < c; ++k) a[c][c] -= a[c][k] * a[c][k];
        a[c][c] = std::sqrt(a[c][c]);
        for (size_t r = c + 1; r < kRows; ++r) {
            for (size_t k = 0; k < c; ++k) a[r][c] -= a[r][k] * a[c][k];
            a[r][c] /= a[c][c];
        }
    }
}

/// The inverse of the lower triangle.
Matrix inverse_of_lower(const Matrix& l) {
    Matrix inverse{};
    for (size_t c = 0; c < kRows; ++c) {
        inverse[c][c] = 1 / l[c][c];
        for (size_t r = c + 1; r < kRows; ++r) {
            for (size_t k = c; k < r; ++k) inverse[r][c] -= l[r][k] * inverse[k][c];
            inverse[r][c] /= l[r][r];
        }
    }
    return inverse;
}

/// From the sum of J^T J over the points.
MotionBasis basis_of(Matrix& a, size_t points, bool focal, double extent) {
    for (size_t r = 0; r < kRows; ++r) {
        for (size_t c = 0; c < kRows; ++c) {
            a[r][c] /= double(std::max<size_t>(points, 1));
            if (!focal && (r == kFocalRow || c == kFocalRow)) a[r][c] = 0;
        }
        // A camera that sees nothing has a basis for points one extent away.
        const double unit = r > kFocalRow ? 1 / (extent * extent) : 1;
        a[r][r] += points > 0 && a[r][r] > 0 ? kDamping * a[r][r] : unit;
    }
    factorise(a);
    const Matrix inverse = inverse_of_lower(a);
    MotionBasis basis{};
    for (uint32_t r = 0; r < kRows; ++r)
        for (uint32_t c = 0; c < kRows; ++c)
            if (focal || r != kFocalRow) basis[kRows * r + c] = float(inverse[c][r]);
    return basis;
}

}  // namespace

MotionBasis motion_basis(const Camera& camera, const Gaussians& gaussians, bool focal, double extent) {
    Matrix a{};
    const size_t points = add_points(a, camera, gaussians, false);
    return basis_of(a, points, focal, extent);
}

MotionBasis readout_basis(const Camera& camera, const Gaussians& gaussians, double extent) {
    Matrix a{};
    const size_t points = add_points(a, camera, gaussians, true);
    return basis_of(a, points, false, extent);
}

MotionBases motion_bases(const std::vector<Camera>& cameras, const Gaussians& gaussians, bool focal,
                         double extent) {
    MotionBases bases;
    for (const Camera& camera : cameras) {
        bases.poses.push_back(motion_basis(camera, gaussians, focal, extent));
        bases.rolling.push_back(camera.readout.has_value());
    }
    if (std::ranges::find(bases.rolling, true) == bases.rolling.end()) {
        bases.rolling.clear();
        return bases;
    }
    for (const Camera& camera : cameras)
        bases.readouts.push_back(camera.readout ? readout_basis(camera, gaussians, extent) : MotionBasis{});
    return bases;
}

Motions::Motions(gpu::Device& device, const MotionBases& of_photos)
    : photos(uint32_t(of_photos.poses.size())),
      rolling(of_photos.rolling),
      camera(device, "moved camera", sizeof(shared::CameraBlock), gpu::Texel::none, true) {
    static_cast<LearnedTable&>(*this) = LearnedTable(
        device, {.name = "motions", .moments = "motion_moments", .row_floats = shared::MOTION_FLOATS},
        std::vector<float>(shared::MOTION_FLOATS * count()));
    std::vector<MotionBasis> all = of_photos.poses;
    all.insert(all.end(), of_photos.readouts.begin(), of_photos.readouts.end());
    bases = gpu::Buffer(device, "motion bases", std::as_bytes(std::span(all)).size());
    bases.upload(std::span<const MotionBasis>(all));
}

std::vector<LearnedTable::Array> Motions::arrays() {
    std::vector<Array> arrays = LearnedTable::arrays();
    if (!empty()) arrays.push_back({"motion_bases", &bases, 4ull * shared::MOTION_BASIS_FLOATS * count()});
    return arrays;
}

std::vector<CameraMotion> Motions::download() const {
    const std::vector<float> all = LearnedTable::download();
    std::vector<CameraMotion> motions(photos);
    for (uint32_t i = 0; i < photos; ++i) {
        const float* f = &all[shared::MOTION_FLOATS * i];
        motions[i] = {{f[0], f[1], f[2]}, f[3], {f[4], f[5], f[6]}, {}, {}};
        if (!has_readout(i)) continue;
        f += shared::MOTION_FLOATS * size_t(photos);
        motions[i].readout_turn = {f[0], f[1], f[2]};
        motions[i].readout_shift = {f[4], f[5], f[6]};
    }
    return motions;
}

CameraUse record_move_camera(const passes::Recorder& on, const Motions& motions, uint32_t photo,
                             const CameraUse& base) {
    on.record(passes::MoveCamera{.camera = {*base.buffer, base.offset, sizeof(shared::CameraBlock)},
                                 .motions = motions.values,
                                 .moved = motions.camera},
              {.motion = photo, .readout = motions.has_readout(photo) ? motions.photos + photo : photo});
    CameraUse use = base;
    use.buffer = &motions.camera;
    use.offset = 0;
    // One that is at rest may have learned to move.
    if (motions.has_readout(photo)) use.lenses = shared::LENSES_ROLLING;
    return use;
}

void record_motion_sums(const passes::Recorder& on, const FrameBuffers& frame, bool readout) {
    on.record(
        passes::Reduce{.source = frame.motion_sums, .sums = frame.motion_reduced, .counts = frame.counts},
        {.items = frame.sizes.motion_items,
         .block = frame.sizes.reduce_block,
         .target = shared::REDUCE_TO_SUMS,
         .rows = readout ? shared::READOUT_MOTION_VALUES : kRows,
         .scale = 1});
}

void record_motion_update(const passes::Recorder& on, const FrameBuffers& frame, const MotionUse& use) {
    const Motions& m = *use.motions;
    const auto [bias1, bias2] = adam_biases(use.visit, kBeta1, kBeta2);
    shared::MotionUpdatePush push{.motion = use.photo,
                                  .first_row = 0,
                                  .blocks = frame.sizes.motion_blocks,
                                  .rate = use.rate,
                                  .pull = kMotionPull,
                                  .shift_pull = kMotionPull / (use.extent * use.extent),
                                  .beta1 = float(kBeta1),
                                  .beta2 = float(kBeta2),
                                  .bias1 = bias1,
                                  .bias2 = bias2,
                                  .instance_capacity = frame.instance_capacity};
    const auto record = [&] {
        on.record(passes::MotionUpdate{.sums = frame.motion_reduced,
                                       .motions = m.values,
                                       .moments1 = m.moments1,
                                       .moments2 = m.moments2,
                                       .bases = m.bases,
                                       .counts = frame.counts},
                  push);
    };
    record();
    if (!m.has_readout(use.photo)) return;
    push.motion += m.photos;
    push.first_row = kRows;
    record();
}

CameraMotion download_motion_gradient(const FrameBuffers& frame, bool readout) {
    const uint32_t blocks = frame.sizes.motion_blocks;
    const uint32_t rows = readout ? shared::READOUT_MOTION_VALUES : kRows;
    const auto sums = frame.motion_reduced.download<float>(size_t(rows) * blocks);
    const auto row = [&](uint32_t r) {
        double sum = 0;
        for (uint32_t b = 0; b < blocks; ++b) sum += sums[r * blocks + b];
        return sum;
    };
    CameraMotion motion{{row(0), row(1), row(2)}, row(3), {row(4), row(5), row(6)}, {}, {}};
    if (!readout) return motion;
    motion.readout_turn = {row(kRows), row(kRows + 1), row(kRows + 2)};
    motion.readout_shift = {row(kRows + 4), row(kRows + 5), row(kRows + 6)};
    return motion;
}

}  // namespace ewa::pipeline
