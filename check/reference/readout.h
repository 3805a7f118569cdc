// SPDX-License-Identifier: Apache-2.0
// A splat that a rolling shutter sees. Let y(X, t) be the point X in camera coordinates at the share t of the readout, and pi(y) its
// pixel. The pixel of X is at its own row's time:
//   t = first + slope . pi(y(X, t))
// For a point at rest, dy/dt = v = turn x y - exp(t turn) shift. With J = dpi/dy and r = J^T slope,
//   dt = k r . dy and k = 1 / (1 - r . v), where dy is at a fixed time
//   d(pixel) = J' dy with J' = J (I + k v r^T) = (I - (J v) slope^T)^-1 J
// J' projects the covariance, at the pose of that time. Where t is cut off, at READOUT_MARGIN beyond the image, r is 0.
#pragma once
#include <glm/vec3.hpp>

#include "ewa/camera.h"
#include "ewa/camera_motion.h"
#include "reference/lens.h"

namespace ewa::reference {

struct ReadoutImage {
    bool moves = false;    // else the members below are not set
    double share = 0;      // t
    Camera camera;         // at that time
    glm::dvec3 turn{0};    // of the readout
    glm::dvec3 shift{0};   // exp(t turn) shift
    glm::dvec3 point{0};   // y
    glm::dvec3 motion{0};  // v
    glm::dvec3 row{0};     // r
    double gain = 1;       // k
    glm::dvec2 slope{0};   // 0 where t is cut off
    LensImage still;       // without the readout's part
};

/// Where the camera shows a point of the world. image: its pixel, J' for J, and d(pixel)/dy for the exact rows; not its hessian.
/// image.shown is false also where the readout has no one time for the point.
ReadoutImage readout_image(const Camera& camera, const glm::dvec3& mean, LensImage& image);

/// What depends on a splat's place and time through its image.
struct ReadoutGradient {
    Rows rows;             // dL/dJ'
    glm::dvec3 exact{0};   // dL/dy through the pixel, by the exact rows of the image
    double by_axes = 0;    // dL/dt through the axes of the splat, which turn with the camera's
    glm::dvec3 offset{0};  // dL/d(mean - camera position), in the world, through the colour
};

/// dL/dy at the splat's time, for all of it but `offset`, whose own part the mean has directly. by_motion: dL/dv.
glm::dvec3 readout_backward(const ReadoutImage& image, const ReadoutGradient& gradient,
                            glm::dvec3& by_motion);

/// Adds the gradient by the camera's motion, for no motion. by_point, by_motion: of readout_backward. by_axes: dL/d(rotation of the
/// splat's axes, in camera axes at its time). by_mean: dL/d(mean), in the world.
void add_rolling_gradient(const ReadoutImage& image, const Camera& camera, const glm::dvec3& by_point,
                          const glm::dvec3& by_motion, const glm::dvec3& by_axes, const glm::dvec3& by_mean,
                          CameraMotion& out);

}  // namespace ewa::reference
