// SPDX-License-Identifier: Apache-2.0
#include "scene/readout.h"

#include <cmath>
#include <glm/ext/quaternion_double.hpp>
#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>
#include <glm/matrix.hpp>

#include "ewa/error.h"
#include "shared/constants.h"

namespace ewa::scene {
namespace {

/// Axis times angle of a rotation by less than half a turn.
glm::dvec3 turn_of(const glm::dmat3& rotation) {
    glm::dquat q = glm::normalize(glm::dquat(rotation));
    if (q.w < 0) q = -q;
    const glm::dvec3 v(q.x, q.y, q.z);
    const double sine = glm::length(v);
    return sine > 0 ? 2 * std::atan2(sine, q.w) / sine * v : 2.0 * v;
}

glm::dmat3 rotation_by(const glm::dvec3& turn) {
    const double angle = glm::length(turn);
    return angle > 0 ? glm::mat3_cast(glm::angleAxis(angle, turn / angle)) : glm::dmat3(1);
}

}  // namespace

ReadoutMotion readout_motion(const Camera& camera) {
    ReadoutMotion motion;
    if (!camera.readout) return motion;
    const Readout& end = *camera.readout;
    motion.turn = turn_of(end.rotation * glm::transpose(camera.rotation));
    const glm::dvec3 position = -(glm::transpose(end.rotation) * end.translation);
    motion.shift = camera.rotation * (position - camera.position());
    const bool rows = end.from == ReadoutFrom::top || end.from == ReadoutFrom::bottom;
    const bool backward = end.from == ReadoutFrom::bottom || end.from == ReadoutFrom::right;
    motion.first = backward ? 1 : 0;
    const double rate = (backward ? -1.0 : 1.0) / (rows ? camera.height : camera.width);
    motion.slope = rows ? glm::dvec2(0, rate) : glm::dvec2(rate, 0);
    return motion;
}

ReadoutMotion middle_motion(const Camera& camera) {
    ReadoutMotion motion = readout_motion(camera);
    motion.shift = rotation_by(0.5 * motion.turn) * motion.shift;
    motion.first -= 0.5;
    return motion;
}

bool moves(const Camera& camera) {
    return camera.readout &&
           (camera.readout->rotation != camera.rotation || camera.readout->translation != camera.translation);
}

Camera at_share(const Camera& camera, double share) {
    Camera result = camera;
    result.readout.reset();
    if (!moves(camera)) return result;
    const ReadoutMotion motion = readout_motion(camera);
    result.rotation = rotation_by(share * motion.turn) * camera.rotation;
    result.translation =
        -(result.rotation * (camera.position() + glm::transpose(camera.rotation) * (share * motion.shift)));
    return result;
}

Camera at_middle(const Camera& camera) {
    return at_share(camera, 0.5);
}

void add_readout(Camera& camera, ReadoutFrom from, const glm::dvec3& turn, const glm::dvec3& way) {
    const glm::dmat3 middle = camera.rotation;
    const glm::dvec3 position = camera.position();
    Readout end{from, rotation_by(0.5 * turn) * middle, {}};
    end.translation = -(end.rotation * (position + 0.5 * way));
    camera.rotation = rotation_by(-0.5 * turn) * middle;
    camera.translation = -(camera.rotation * (position - 0.5 * way));
    camera.readout = end;
}

std::optional<PixelRay> world_ray(const Camera& camera, double limit, double x, double y) {
    const auto ray = ray_of(camera, limit, x, y);
    if (!ray) return std::nullopt;
    Camera at = camera;
    if (moves(camera)) {
        const ReadoutMotion motion = readout_motion(camera);
        at = at_share(camera, motion.first + motion.slope.x * x + motion.slope.y * y);
    }
    const glm::dmat3 to_world = glm::transpose(at.rotation);
    return PixelRay{at.position() + to_world * ray->origin, to_world * ray->direction};
}

void check_readout_lens(const Camera& camera) {
    const Lens lens = camera.distortion.lens;
    if (lens != Lens::brown && lens != Lens::fisheye)
        throw InputError("a rolling shutter takes perspective and fisheye images only");
}

void check_readout(const Camera& camera) {
    if (!moves(camera)) return;
    check_readout_lens(camera);
    if (!(glm::length(readout_motion(camera).turn) <= shared::READOUT_TURN_MAX))
        throw InputError(
            "the camera turns by more than 90 degrees while its rolling shutter reads the image; are the "
            "poses of "
            "start and end its own?");
}

}  // namespace ewa::scene
