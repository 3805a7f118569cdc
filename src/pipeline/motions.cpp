// SPDX-License-Identifier: Apache-2.0
#include "pipeline/motions.h"

#include <algorithm>
#include <cmath>

#include "passes/passes.h"
#include "pipeline/adam.h"
#include "pipeline/model.h"

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

using Matrix = std::array<std::array<double, kRows>, kRows>;

/// Adds J^T J of the points that the camera sees. Returns their number.
size_t add_points(Matrix& a, const Camera& camera, const Gaussians& gaussians) {
    std::vector<glm::dvec3> seen;
    for (size_t i = 0; i < gaussians.size(); ++i) {
        const glm::dvec3 p = camera.rotation * gaussians.world_mean(i) + camera.translation;
        if (!(p.z > shared::NEAR_PLANE)) continue;
        const double x = camera.fx * p.x / p.z + camera.cx, y = camera.fy * p.y / p.z + camera.cy;
        if (x >= 0 && x < camera.width && y >= 0 && y < camera.height) seen.push_back(p);
    }
    const size_t stride = seen.size() / kBasisPoints + 1;
    size_t points = 0;
    for (size_t i = 0; i < seen.size(); i += stride, ++points)
        for (const int row : {0, 1}) {
            const auto j = image_derivative(seen[i], row);
            for (size_t r = 0; r < kRows; ++r)
                for (size_t c = 0; c < kRows; ++c) a[r][c] += j[r] * j[c];
        }
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

}  // namespace

MotionBasis motion_basis(const Camera& camera, const Gaussians& gaussians, bool focal, double extent) {
    Matrix a{};
    const size_t points = add_points(a, camera, gaussians);
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

Motions::Motions(gpu::Device& device, const std::vector<MotionBasis>& of_photos)
    : photos(uint32_t(of_photos.size())),
      values(device, "motions", bytes()),
      moments1(device, "motion moments1", bytes()),
      moments2(device, "motion moments2", bytes()),
      bases(device, "motion bases", basis_bytes()),
      camera(device, "moved camera", sizeof(shared::CameraBlock), gpu::Texel::none, true) {
    zero(values);
    zero(moments1);
    zero(moments2);
    bases.upload(std::span<const MotionBasis>(of_photos));
}

std::vector<CameraMotion> Motions::download() const {
    const auto floats = values.download<float>(size_t(shared::MOTION_FLOATS) * photos);
    std::vector<CameraMotion> motions(photos);
    for (size_t i = 0; i < photos; ++i) {
        const float* f = &floats[shared::MOTION_FLOATS * i];
        motions[i] = {{f[0], f[1], f[2]}, f[3], {f[4], f[5], f[6]}};
    }
    return motions;
}

CameraUse record_move_camera(const passes::Recorder& on, const Motions& motions, uint32_t photo,
                             const CameraUse& base) {
    on.record(passes::MoveCamera{.camera = {*base.buffer, base.offset, sizeof(shared::CameraBlock)},
                                 .motions = motions.values,
                                 .moved = motions.camera},
              {.photo = photo});
    return {&motions.camera, 0, base.width, base.height};
}

void record_motion_sums(const passes::Recorder& on, const FrameBuffers& frame) {
    on.record(
        passes::Reduce{.source = frame.motion_sums, .sums = frame.motion_reduced, .counts = frame.counts},
        {.items = frame.sizes.motion_items,
         .block = frame.sizes.reduce_block,
         .target = shared::REDUCE_TO_SUMS,
         .rows = kRows,
         .scale = 1});
}

void record_motion_update(const passes::Recorder& on, const FrameBuffers& frame, const MotionUse& use) {
    const Motions& m = *use.motions;
    const auto [bias1, bias2] = adam_biases(use.visit, kBeta1, kBeta2);
    on.record(passes::MotionUpdate{.sums = frame.motion_reduced,
                                   .motions = m.values,
                                   .moments1 = m.moments1,
                                   .moments2 = m.moments2,
                                   .bases = m.bases,
                                   .counts = frame.counts},
              {.photo = use.photo,
               .blocks = frame.sizes.motion_blocks,
               .rate = use.rate,
               .pull = kMotionPull,
               .shift_pull = kMotionPull / (use.extent * use.extent),
               .beta1 = float(kBeta1),
               .beta2 = float(kBeta2),
               .bias1 = bias1,
               .bias2 = bias2,
               .instance_capacity = frame.instance_capacity});
}

CameraMotion download_motion_gradient(const FrameBuffers& frame) {
    const uint32_t blocks = frame.sizes.motion_blocks;
    const auto sums = frame.motion_reduced.download<float>(size_t(kRows) * blocks);
    const auto row = [&](uint32_t r) {
        double sum = 0;
        for (uint32_t b = 0; b < blocks; ++b) sum += sums[r * blocks + b];
        return sum;
    };
    return {{row(0), row(1), row(2)}, row(3), {row(4), row(5), row(6)}};
}

}  // namespace ewa::pipeline
