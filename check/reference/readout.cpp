// SPDX-License-Identifier: Apache-2.0
#include "reference/readout.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>

#include "reference/motion.h"
#include "scene/readout.h"
#include "shared/constants.h"

namespace ewa::reference {

using namespace shared;
namespace {

/// The point and its image at a share of the readout.
void set_share(const Camera& camera, const scene::ReadoutMotion& motion, const glm::dvec3& mean, double share,
               ReadoutImage& out) {
    out.share = share;
    out.camera = scene::at_share(camera, share);
    out.point = out.camera.rotation * (mean - out.camera.position());
    out.shift = out.camera.rotation * (glm::transpose(camera.rotation) * motion.shift);
    out.motion = glm::cross(motion.turn, out.point) - out.shift;
    out.still = lens_image(out.camera, out.point);
    if (!out.still.shown) return;
    out.row = motion.slope.x * out.still.exact.x + motion.slope.y * out.still.exact.y;
}

/// By how much the readout's share of the pixel is late, cut off at the margin. Sets the slope to zero where it is cut off.
double lateness(const scene::ReadoutMotion& motion, ReadoutImage& at) {
    const double share = motion.first + glm::dot(motion.slope, at.still.pixel);
    const double cut = std::clamp(share, -READOUT_MARGIN, 1 + READOUT_MARGIN);
    at.slope = cut == share ? motion.slope : glm::dvec2(0);
    if (cut != share) at.row = glm::dvec3(0);
    return cut - at.share;
}

}  // namespace

ReadoutImage readout_image(const Camera& camera, const glm::dvec3& mean, LensImage& image) {
    const scene::ReadoutMotion motion = scene::readout_motion(camera);
    ReadoutImage out;
    out.moves = true;
    out.turn = motion.turn;
    double late = 0, next = 0.5, end = 0;
    bool found = false;
    for (uint32_t view = 0; view < READOUT_VIEWS; ++view) {
        set_share(camera, motion, mean, next, out);
        if (out.still.shown) {
            found = true;
            late = lateness(motion, out);
            const double rate = std::max(1 - glm::dot(out.row, out.motion), READOUT_RATE_MIN);
            next = std::clamp(next + late / rate, -READOUT_MARGIN, 1 + READOUT_MARGIN);
        } else {
            if (found || end > 1) break;
            next = end++;
        }
    }
    image = out.still;
    if (!image.shown) return out;
    const double rate = 1 - glm::dot(out.row, out.motion);
    image.shown = rate >= READOUT_RATE_MIN && std::abs(late) <= READOUT_RESIDUAL;
    if (!image.shown) return out;
    out.gain = 1 / rate;
    for (Rows* rows : {&image.jacobian, &image.exact})
        for (glm::dvec3* row : {&rows->x, &rows->y}) *row += out.gain * glm::dot(*row, out.motion) * out.row;
    return out;
}

glm::dvec3 readout_backward(const ReadoutImage& image, const ReadoutGradient& g, glm::dvec3& by_v) {
    const glm::dvec3 &v = image.motion, &r = image.row;
    const double k = image.gain;
    const Rows& j = image.still.jacobian;
    const Rows& by = g.rows;
    // J'_i = J_i + k (J_i . v) r
    const double along_x = glm::dot(j.x, v), along_y = glm::dot(j.y, v);
    const double by_gain = along_x * glm::dot(by.x, r) + along_y * glm::dot(by.y, r);
    const glm::dvec3 by_r = k * (along_x * by.x + along_y * by.y) + k * k * by_gain * v;
    by_v = k * (glm::dot(by.x, r) * j.x + glm::dot(by.y, r) * j.y) + k * k * by_gain * r;
    const Rows by_j{by.x + k * glm::dot(by.x, r) * v, by.y + k * glm::dot(by.y, r) * v};
    glm::dvec3 by_point = glm::cross(by_v, image.turn);
    for (size_t c = 0; c < 3; ++c) {
        const int i = int(c);
        by_point += by_j.x[i] * image.still.hessian[0][c] + by_j.y[i] * image.still.hessian[1][c] +
                    by_r[i] * (image.slope.x * image.still.exact_hessian[0][c] +
                               image.slope.y * image.still.exact_hessian[1][c]);
    }
    const double by_time = g.by_axes - glm::dot(by_v, glm::cross(image.turn, image.shift)) -
                           glm::dot(g.offset, glm::transpose(image.camera.rotation) * image.shift);
    return g.exact + by_point + k * r * (glm::dot(v, by_point) + by_time);
}

void add_rolling_gradient(const ReadoutImage& image, const Camera& camera, const glm::dvec3& by_point,
                          const glm::dvec3& by_motion, const glm::dvec3& by_axes, const glm::dvec3& by_mean,
                          CameraMotion& out) {
    const double time = image.share - 0.5;
    const Camera middle = scene::at_middle(camera);
    const glm::dvec3 shift = scene::middle_motion(camera).shift;
    // With the point p in the middle, y = R (p - time shift) and v = turn x y - R shift. Where the axes turn by w, the centre
    // of the camera at this time moves too, as if p moved by w x (time shift).
    const glm::dmat3 back = middle.rotation * glm::transpose(image.camera.rotation);  // R^T
    const glm::dvec3 by_middle = middle.rotation * by_mean;
    const glm::dvec3 torque = glm::cross(image.point, by_point) + by_axes;
    out.rotation += back * torque + time * glm::cross(shift, by_middle);
    out.shift -= by_middle;
    // A change of the turn turns y and the axes, and R in v.
    const CameraMotion turned{time * image.turn};
    const CameraMotion later{torque - glm::cross(image.shift, by_motion)};
    out.readout_turn += time * motion_backward(turned, later).rotation + glm::cross(image.point, by_motion);
    out.readout_shift -= time * by_middle + back * by_motion;
}

}  // namespace ewa::reference
