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

/// A point of the world is at exp(share * turn) (p - share * shift), where p is its place at the first pose. Camera axes.
struct ReadoutMotion {
    glm::dvec3 turn{0};   // of the camera's axes: axis times angle, radians
    glm::dvec3 shift{0};  // of the camera's centre, along the axes of the first pose (world units)
    double first = 0;     // share of a pixel: first + dot(slope, pixel)
    glm::dvec2 slope{0};  // 1 / px
};

/// All zeros with a global shutter.
ReadoutMotion readout_motion(const Camera& camera);

/// The same for times from the middle of the readout, -0.5 to 0.5, where p and the axes are those of the pose in the middle.
ReadoutMotion middle_motion(const Camera& camera);

/// Whether the camera moves during its readout. If not, its images are those of a global shutter.
bool moves(const Camera& camera);

/// The camera at a share of its readout, with a global shutter.
Camera at_share(const Camera& camera, double share);

/// The camera at the middle of its readout, with a global shutter: what of a moving camera counts where one pose must do.
Camera at_middle(const Camera& camera);

/// Gives the camera a rolling shutter. Its pose becomes that of the middle of the readout. During the readout it turns by `turn` (its own
/// axes: axis times angle, radians), and its centre moves by `way` (world).
void add_readout(Camera& camera, ReadoutFrom from, const glm::dvec3& turn, const glm::dvec3& way);

/// What a position in the image sees, as ray_of has it, but in the world, and with a rolling shutter at its own time.
std::optional<PixelRay> world_ray(const Camera& camera, double limit, double x, double y);

/// Throws InputError where splats cannot be rendered through this camera while it moves.
void check_readout(const Camera& camera);
/// The same, whatever its motion.
void check_readout_lens(const Camera& camera);

}  // namespace ewa::scene
