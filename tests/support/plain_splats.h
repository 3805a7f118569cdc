// SPDX-License-Identifier: Apache-2.0
// Random splats and views for the operators of projection, as arrays of floats, and the same for the CPU reference.
#pragma once
#include <cmath>
#include <glm/mat3x3.hpp>
#include <glm/matrix.hpp>
#include <glm/vec3.hpp>
#include <vector>

#include "ewa/operators.h"
#include "reference/plain_projection.h"
#include "reference/projection.h"
#include "support/random_scene.h"

namespace ewa::test {

struct PlainScene {
    std::vector<float> means, quaternions, scales, covariances, opacities, view_matrices, intrinsics;
    std::vector<Distortion> lenses;
    ProjectionOptions options;

    size_t size() const { return means.size() / 3; }
    size_t views() const { return view_matrices.size() / 16; }
    SplatArrays splats() const { return {means, quaternions, scales, covariances, opacities}; }
    ViewArrays view_arrays() const { return {view_matrices, intrinsics, lenses}; }
    reference::PlainSplat splat(size_t i) const {
        reference::PlainSplat s;
        for (int k = 0; k < 3; ++k) s.mean[k] = means[3 * i + size_t(k)];
        s.has_covariance = !covariances.empty();
        if (s.has_covariance) {
            for (size_t k = 0; k < 6; ++k) s.covariance[k] = covariances[6 * i + k];
        } else {
            for (size_t k = 0; k < 4; ++k) s.quaternion[k] = quaternions[4 * i + k];
            for (int k = 0; k < 3; ++k) s.scale[k] = scales[3 * i + size_t(k)];
        }
        if (!opacities.empty()) s.opacity = opacities[i];
        return s;
    }
    reference::PlainOptions reference_options() const {
        const ProjectionOptions& o = options;
        return {o.width, o.height, o.low_pass, o.near, o.far, o.radius_clip, o.compensations, o.whiteners};
    }
    reference::PlainView view(size_t v) const {
        reference::PlainView out;
        for (int row = 0; row < 3; ++row) {
            const float* from = &view_matrices[16 * v + 4 * size_t(row)];
            for (int column = 0; column < 3; ++column) out.rotation[column][row] = from[column];
            out.translation[row] = from[3];
        }
        const float* k = &intrinsics[9 * v];
        out.focal = {k[0], k[4]};
        out.center = {k[2], k[5]};
        if (!lenses.empty()) out.lens = lenses[v];
        return out;
    }
    /// Replaces quaternions and scales.
    void use_covariances();
};

inline void PlainScene::use_covariances() {
    std::vector<float> all;
    for (size_t i = 0; i < size(); ++i) {
        const reference::PlainSplat s = splat(i);
        const double norm = reference::robust_norm(s.quaternion);
        glm::dmat3 axes = reference::rotation_matrix(
            {s.quaternion[0] / norm, s.quaternion[1] / norm, s.quaternion[2] / norm, s.quaternion[3] / norm});
        for (int k = 0; k < 3; ++k) axes[k] *= s.scale[k];
        const glm::dmat3 sigma = axes * glm::transpose(axes);
        for (const double value :
             {sigma[0][0], sigma[0][1], sigma[0][2], sigma[1][1], sigma[1][2], sigma[2][2]})
            all.push_back(float(value));
    }
    covariances = all;
    quaternions.clear();
    scales.clear();
}

/// One view after another of splats of a kind, which are in front of the first view. The matrices are rotations, but for
/// the rounding to float32 and for `bend`, the size of a random matrix that is added to each.
inline PlainScene plain_scene(uint64_t seed, size_t splats, SplatKind kind, size_t views, int width,
                              int height, double bend = 0) {
    PlainScene scene;
    const Camera first = random_camera(seed, width, height);
    const Gaussians g = random_gaussians(seed + 1, splats, kind, first, 0);
    scene.options.width = uint32_t(width);
    scene.options.height = uint32_t(height);
    scene.means = g.means;
    scene.quaternions = g.quaternions;
    for (const float s : g.log_scales) scene.scales.push_back(std::exp(s));
    for (const float logit : g.opacity_logits) scene.opacities.push_back(1 / (1 + std::exp(-logit)));
    Random random(seed + 2);
    for (size_t v = 0; v < views; ++v) {
        Camera camera = first;
        if (v > 0) {  // turned a little, and moved
            const double angle = 0.1 * random.normal();
            const glm::dmat3 turn(std::cos(angle), std::sin(angle), 0, -std::sin(angle), std::cos(angle), 0,
                                  0, 0, 1);
            camera.rotation = turn * camera.rotation;
            camera.translation = turn * camera.translation;
            for (int k = 0; k < 3; ++k) camera.translation[k] += 0.2 * random.normal();
        }
        for (int row = 0; row < 4; ++row)
            for (int column = 0; column < 4; ++column)
                scene.view_matrices.push_back(
                    row == 3      ? float(column == 3)
                    : column == 3 ? float(camera.translation[row])
                                  : float(camera.rotation[column][row] + bend * random.normal()));
        for (const double value : {camera.fx, 0.0, camera.cx, 0.0, camera.fy, camera.cy, 0.0, 0.0, 1.0})
            scene.intrinsics.push_back(float(value));
    }
    return scene;
}

}  // namespace ewa::test
