// SPDX-License-Identifier: Apache-2.0
#include "ewa/camera_motion.h"

#include <algorithm>
#include <cmath>
#include <glm/ext/quaternion_double.hpp>
#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>
#include <glm/matrix.hpp>
#include <glm/trigonometric.hpp>

#include "scene/readout.h"
#include "shared/constants.h"

namespace ewa {
namespace {

/// The motion during the readout, and what is learned of it.
void add_learned_readout(Camera& middle, const Camera& camera, const CameraMotion& motion) {
    const scene::ReadoutMotion given = scene::middle_motion(camera);
    glm::dvec3 turn = given.turn + motion.readout_turn;
    if (const double angle = glm::length(turn); angle > shared::READOUT_TURN_LEARNED)
        turn *= shared::READOUT_TURN_LEARNED / angle;
    scene::add_readout(middle, camera.readout->from, turn,
                       glm::transpose(middle.rotation) * (given.shift + motion.readout_shift));
}

}  // namespace

Camera moved(const Camera& camera, const CameraMotion& motion) {
    if (motion == CameraMotion{}) return camera;
    Camera result = scene::at_middle(camera);
    const glm::dvec3 position = result.position() + glm::transpose(result.rotation) * motion.shift;
    const double angle = glm::length(motion.rotation);
    if (angle > 0)
        result.rotation = glm::mat3_cast(glm::angleAxis(angle, motion.rotation / angle)) * result.rotation;
    result.translation = -(result.rotation * position);
    result.fx *= std::exp(motion.log_focal);
    result.fy *= std::exp(motion.log_focal);
    if (camera.readout) add_learned_readout(result, camera, motion);
    return result;
}

CameraDistance distance_between(const Camera& from, const Camera& to) {
    const Camera a = scene::at_middle(from), b = scene::at_middle(to);
    const glm::dquat turn(b.rotation * glm::transpose(a.rotation));
    const double angle = 2 * std::atan2(glm::length(glm::dvec3(turn.x, turn.y, turn.z)), std::abs(turn.w));
    return {glm::degrees(angle), glm::length(b.position() - a.position()), b.fx / a.fx};
}

}  // namespace ewa
