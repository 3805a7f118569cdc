// SPDX-License-Identifier: Apache-2.0
// The motion of a camera while a rolling shutter reads the image. A share of the readout is 0 at the border where it begins, and 1
// at the opposite border.
#pragma once
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <optional>

#include "core/words.h"
#include "ewa/camera.h"
#include "scene/native_lens.h"

namespace ewa::scene {

inline const core::Words<ReadoutFrom> kReadoutWords{{"top-to-bottom", ReadoutFrom::top},
                                                    {"bottom-to-top", ReadoutFrom::bottom},
                                                    {"left-to-right", ReadoutFrom::left},
                                                    {"right-to-left", ReadoutFrom::right}};

/// The motion of a camera during its readout. A world point with the camera coordinates p at the first pose has exp(share * turn)
/// (p - share * shift) at a share of the readout.
struct ReadoutMotion {
    glm::dvec3 turn{0};   // of the camera's axes: axis times angle, radians
    glm::dvec3 shift{0};  // of the camera's centre, along the axes of the first pose (world units)
    double first = 0;     // share of a pixel: first + dot(slope, pixel)
    glm::dvec2 slope{0};  // 1 / px
};

/// The motion of this camera from its first pose. All values are zero with a global shutter.
ReadoutMotion readout_motion(const Camera& camera);

/// The motion relative to the pose at mid-readout: p and the axes are those of that pose, and shares are from -0.5 to 0.5.
ReadoutMotion middle_motion(const Camera& camera);

/// Whether the camera moves during its readout. If not, its images are those of a global shutter.
bool moves(const Camera& camera);

/// The camera at a share of its readout, with a global shutter.
Camera at_share(const Camera& camera, double share);

/// The camera at the middle of its readout, with a global shutter: for work that takes one pose of a moving camera.
Camera at_middle(const Camera& camera);

/// Gives the camera a rolling shutter. Its pose becomes that of the middle of the readout. During the readout it turns by `turn` (its own
/// axes: axis times angle, radians), and its centre moves by `way` (world).
void add_readout(Camera& camera, ReadoutFrom from, const glm::dvec3& turn, const glm::dvec3& way);

/// The ray of a position in the image, as ray_of, but in world coordinates and with the pose at that position's readout time.
std::optional<PixelRay> world_ray(const Camera& camera, double limit, double x, double y);

/// Throws InputError if the camera moves during its readout, and turns by more than READOUT_TURN_MAX or has a lens that excludes
/// it.
void check_readout(const Camera& camera);
/// Throws InputError if the camera's lens cannot be rendered with a rolling shutter, even if the camera does not move.
void check_readout_lens(const Camera& camera);

}  // namespace ewa::scene
