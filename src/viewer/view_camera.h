// SPDX-License-Identifier: Apache-2.0
// The camera that mouse and keys move: around a pivot, towards it, or freely. Independent of the window.
#pragma once
#include <glm/vec3.hpp>

#include "ewa/camera.h"

namespace ewa::viewer {

/// The camera for an image of another size. The view of `camera` stays visible and centred; pixels stay
/// square. The same size returns the same camera, bit for bit.
Camera fitted(const Camera& camera, int width, int height);

/// A place to look from, and the point to orbit.
struct Viewpoint {
    Camera camera;
    glm::dvec3 pivot{0, 0, 1};  // world; the centre of orbiting
    glm::dvec3 up{0, -1, 0};    // world, unit length
    double radius = 1;          // of the scene, world units
};

class ViewCamera {
  public:
    explicit ViewCamera(const Viewpoint& start) : start_(start) { reset(); }

    /// Angles in radians of a drag to the right and down. The scene follows the pointer.
    void orbit(double right, double down);  // about the pivot
    void look(double right, double down);   // about the camera itself
    /// Pixels of an image of this size. Points at the distance of the pivot follow the pointer.
    void pan(double right, double down, int width, int height);
    /// Positive: closer. A step reduces the distance to the pivot by a tenth.
    void zoom(double steps);
    /// Moves along the camera axes (x right, y down, z forward), in units of the distance to the pivot.
    void fly(const glm::dvec3& amount);
    /// Turns to a point and makes it the pivot.
    void focus(const glm::dvec3& point);
    void reset();
    void restart(const Viewpoint& start);
    void set_up(const glm::dvec3& up);

    /// Moves to another place. reset() still returns to the start.
    void stand(const Viewpoint& place);
    Viewpoint place() const { return {camera_, pivot_, up_, start_.radius}; }
    const glm::dvec3& up() const { return up_; }
    double radius() const { return start_.radius; }
    double distance() const;
    Camera camera(int width, int height) const { return fitted(camera_, width, height); }

  private:
    void turn(double yaw, double pitch, const glm::dvec3& center);
    void place(const glm::dmat3& rotation, const glm::dvec3& position);
    glm::dvec3 axis(int row) const;  // the camera's x, y or z axis in world coordinates

    Viewpoint start_;
    Camera camera_;
    glm::dvec3 pivot_{0}, up_{0, -1, 0};
};

}  // namespace ewa::viewer
