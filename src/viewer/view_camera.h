// SPDX-License-Identifier: Apache-2.0
// The camera that mouse and keys move: around a pivot, towards it, or freely. Knows nothing of windows.
#pragma once
#include <glm/vec3.hpp>

#include "ewa/camera.h"

namespace ewa::viewer {

/// The camera for a picture of another size: what `camera` shows stays in view, centred, with square pixels
/// of one scale. The same size gives back the same camera, bit for bit.
Camera fitted(const Camera& camera, int width, int height);

/// Where a view starts from, and what it moves about.
struct Viewpoint {
    Camera camera;
    glm::dvec3 pivot{0, 0, 1};  // world; what orbiting turns about
    glm::dvec3 up{0, -1, 0};    // world, unit length
    double radius = 1;          // of the scene, world units
};

class ViewCamera {
  public:
    explicit ViewCamera(const Viewpoint& start) : start_(start) { reset(); }

    /// Angles in radians, of a drag to the right and down: the scene follows the pointer.
    void orbit(double right, double down);  // about the pivot
    void look(double right, double down);   // about the camera itself
    /// Pixels of a picture of this height: what is at the pivot's distance follows the pointer.
    void pan(double right, double down, int width, int height);
    /// Positive: closer. A step takes off a tenth of the distance to the pivot.
    void zoom(double steps);
    /// Camera axes (x right, y down, z forward), in distances to the pivot.
    void fly(const glm::dvec3& amount);
    /// Turns to a point, which becomes the pivot.
    void focus(const glm::dvec3& point);
    void reset();
    void restart(const Viewpoint& start);
    void set_up(const glm::dvec3& up);

    /// Another place to stand; what reset() comes back to stays.
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
